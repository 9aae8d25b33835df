"""One contact from touch to parting: its frame, its law, its ledger, and how short its substeps must be."""
