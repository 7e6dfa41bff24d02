// The range of the polynomial of a Taylor model.
#pragma once
#include "polynomials.hpp"
#include "taylor_models.hpp"

// Polynomials in x from -1 to 1, bounded by their Bernstein coefficients, which are halved while that could matter.
struct Hulls {
    static constexpr int MOST_HALVINGS = 40;
    double matrix[TERMS][TERMS], stack[MOST_HALVINGS + 2][TERMS];
    struct Part { double start, width; } parts[MOST_HALVINGS + 2];
    struct Range { double most, seen, x; };
    Hulls() {
        double unit[TERMS * TERMS], power[TERMS] = {1.0};  // (2 t - 1)^k by powers of t
        bernstein_matrix(TERMS, unit);
        for (int k = 0; k < TERMS; k++) {
            for (int i = 0; i < TERMS; i++) {
                matrix[k][i] = 0.0;
                for (int e = 0; e <= k; e++) matrix[k][i] += power[e] * unit[e * TERMS + i];
            }
            for (int e = k + 1; e >= 0; e--)
                if (e < TERMS) power[e] = (e ? 2.0 * power[e - 1] : 0.0) - (e <= k ? power[e] : 0.0);
        }
    }
    static double rounding(const double* c) {
        double size = 0.0;
        for (int k = 0; k < TERMS; k++) size += fabs(c[k]);
        return 512.0 * UNIT * size;
    }
    void bernstein(const double* c, double* b) const {
        for (int i = 0; i < TERMS; i++) b[i] = 0.0;
        for (int k = 0; k < TERMS; k++)
            for (int i = 0; i < TERMS; i++) b[i] += matrix[k][i] * c[k];
    }
    double least(const double* c) const {
        double b[TERMS], found = INFINITY;
        bernstein(c, b);
        for (int i = 0; i < TERMS; i++) found = fmin(found, b[i]);
        return found - rounding(c);
    }
    // The largest of the magnitudes, or of the values where they count alone: to rounding if it is above `enough`.
    Range largest(const double* c, double enough, bool magnitudes) {
        auto of = [&](double x) { return magnitudes ? fabs(x) : x; };
        Range found{-INFINITY, -INFINITY, 0.0};
        bernstein(c, stack[0]);
        parts[0] = {-1.0, 2.0};
        for (int top = 1; top > 0;) {
            top--;
            double *b = stack[top], hull = -INFINITY;
            const Part part = parts[top];
            for (int i = 0; i < TERMS; i++) hull = fmax(hull, of(b[i]));
            if (of(b[0]) > found.seen) { found.seen = of(b[0]); found.x = part.start; }
            if (of(b[DEGREE]) > found.seen) { found.seen = of(b[DEGREE]); found.x = part.start + part.width; }
            if (hull <= fmax(enough, found.seen + 1e-13 * fabs(found.seen)) || top >= MOST_HALVINGS || part.width < 1e-9) {
                found.most = fmax(found.most, hull);
                continue;
            }
            halve(b, TERMS, b + TERMS, b);  // the first half on top: it is looked at next
            parts[top] = {part.start + 0.5 * part.width, 0.5 * part.width};
            parts[top + 1] = {part.start, 0.5 * part.width};
            top += 2;
        }
        found.most += rounding(c);
        return found;
    }
};
