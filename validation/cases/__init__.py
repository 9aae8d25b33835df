"""One case a file; `validation.case.find_cases` imports them all."""
