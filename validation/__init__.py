"""Published data, error against run time, stability, and the references that judge the laws."""
