"""The only place where the stages meet: one module a command."""
