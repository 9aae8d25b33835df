"""Independent solutions of the contact problem; nothing here imports the package that they judge."""
