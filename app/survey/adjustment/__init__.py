"""The least squares that correct a track by what people state about distances."""
