"""The messages of proto/*.proto; generated when the package is built."""
