"""Recording a session: plan, preflight, runs, gate; only the command line names it."""
