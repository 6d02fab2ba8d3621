"""Laws as source code, and as functional mock-up units."""
