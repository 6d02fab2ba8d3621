"""The page of `mbma explore`."""
