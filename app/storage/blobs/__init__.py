"""Films, photos, tiles and tracks as blobs: files of the data folder or of an object store."""
