"""Pages: one engine, and what it shows of runs, measured records, diagnoses and every other result."""
