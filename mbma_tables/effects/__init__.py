"""Physics that takes a contact: films of lubricant, rough spheres and cylinders."""
