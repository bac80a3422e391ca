"""Model -> plan: names to slices, coefficients to tables, discretisation, found time invariance."""
