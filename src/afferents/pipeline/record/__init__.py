"""Recording a session: plan, preflight, runs, gate."""
