"""What an inspector should look at: findings on the unrolled wall, by any detector."""
