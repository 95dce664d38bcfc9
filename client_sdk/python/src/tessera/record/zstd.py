"""The package zstandard, or what to do where it is missing."""

try:
    import zstandard
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(f"{error}: recordings need tessera[record]", name=error.name) from None

__all__ = ["zstandard"]
