"""The package zstandard, or an error that says how to install it."""

try:
    import zstandard
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(f"{error}: recordings need tessera[record]", name=error.name) from None

__all__ = ["zstandard"]
