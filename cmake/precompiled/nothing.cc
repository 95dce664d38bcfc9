// Compiled only for the precompiled headers.
