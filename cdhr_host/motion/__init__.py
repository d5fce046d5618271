"""Commands -> time: the smoothed path, the speed along it, and samples on the drives' ticks."""
