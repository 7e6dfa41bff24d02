"""The one type of trajectory: piecewise polynomials, their peaks and integrals."""
