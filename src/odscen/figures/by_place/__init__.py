"""What happened where: sums over lanes by segment, junction and movement, and corridors."""
