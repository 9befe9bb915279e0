"""The words, types and refusals that every stage shares; nothing here imports a stage."""
