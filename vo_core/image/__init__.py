"""Pictures by themselves: filters, resampling, the fixed pattern, health."""
