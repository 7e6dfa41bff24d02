"""Operations on the time scaling of any back end: durations, action times, slowing on the same path."""
