"""What a world is made of in memory: records, access to them by address, vectors, and code compiled on demand."""
