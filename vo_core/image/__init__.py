"""Operations on single pictures: filters, resampling, the fixed pattern, health."""
