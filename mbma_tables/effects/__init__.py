"""Films of lubricant between rough faces; rough spheres and cylinders."""
