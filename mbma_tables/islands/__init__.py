"""Contact islands: height integrals, the Greenwood-Tripp problem, geometry."""
