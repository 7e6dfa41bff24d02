// Piecewise polynomials on unit time: derivatives, Bernstein coefficients, values, exact extrema, and how many samples
// a motion takes. Rows are polynomials, (pieces, joints, order) in row order.
#pragma once
#include "vectors.hpp"

// The matrix (order, order) from powers to Bernstein coefficients: comb(i, k) / comb(order - 1, k).
static inline void bernstein_matrix(int64_t order, double* m) {
    for (int64_t i = 0; i < order; i++) {
        double above = 1.0, below = 1.0;  // comb(i, k), comb(order - 1, k)
        for (int64_t k = 0; k < order; k++) {
            m[k * order + i] = above / below;
            above = above * (double)(i - k) / (double)(k + 1);
            below = below * (double)(order - 1 - k) / (double)(k + 1);
        }
    }
}

// The d-th derivatives (joints, order) of a piece, scaled to unit time, and their Bernstein coefficients. ORDER and D are the
// order and d where the compiler knows them, which makes quintics and cubics many times as fast.
template <int64_t ORDER, int64_t D>
static inline void derivatives_of_piece(int64_t joints, int64_t any_order, int64_t any_d, double length, const double* matrix,
                                        double* factor, const double* c, double* __restrict u, double* __restrict b) {
    const int64_t order = ORDER ? ORDER : any_order, d = ORDER ? D : any_d, terms = d < order ? order - d : 0;
    double power = 1.0;
    for (int64_t k = 0; k < terms; k++, power *= length) {
        factor[k] = power;
        for (int64_t f = 0; f < d; f++) factor[k] *= (double)(k + d - f);
    }
    for (int64_t j = 0; j < joints; j++, c += order, u += order, b += order) {
        for (int64_t k = 0; k < terms; k++) u[k] = c[k + d] * factor[k];
        for (int64_t k = terms; k < order; k++) u[k] = 0.0;
        for (int64_t i = 0; i < order; i++) b[i] = u[0];
        for (int64_t k = 1; k < terms; k++)
            for (int64_t i = 0; i < order; i++) b[i] += u[k] * matrix[k * order + i];
    }
}

// Derivatives 0 to count - 1 by time of polynomials of time, scaled to unit time: unit, bernstein (count, pieces, joints, order).
static inline int unit_derivatives(int64_t pieces, int64_t joints, int64_t order, int64_t count, const double* lengths,
                                   const double* coefficients, double* unit, double* bernstein) {
    static constexpr auto ANY = derivatives_of_piece<0, 0>;
    static constexpr decltype(ANY) CUBIC[4] = {derivatives_of_piece<4, 0>, derivatives_of_piece<4, 1>, derivatives_of_piece<4, 2>,
                                               derivatives_of_piece<4, 3>};
    static constexpr decltype(ANY) QUINTIC[6] = {derivatives_of_piece<6, 0>, derivatives_of_piece<6, 1>, derivatives_of_piece<6, 2>,
                                                 derivatives_of_piece<6, 3>, derivatives_of_piece<6, 4>, derivatives_of_piece<6, 5>};
    Scratch<double> matrix(order * order), factor(order);
    if (!matrix || !factor) return NO_MEMORY;
    bernstein_matrix(order, matrix.data);
    for (int64_t d = 0; d < count; d++) {
        const auto of_piece = d < order && order == 6 ? QUINTIC[d] : d < order && order == 4 ? CUBIC[d] : ANY;
        for (int64_t p = 0; p < pieces; p++) {
            const int64_t row = (d * pieces + p) * joints * order;
            of_piece(joints, order, d, lengths[p], matrix.data, factor.data, coefficients + p * joints * order, unit + row,
                     bernstein + row);
        }
    }
    return OK;
}

static inline double horner(const double* c, int64_t order, double x) {
    double value = c[order - 1];
    for (int64_t k = order - 2; k >= 0; k--) value = value * x + c[k];
    return value;
}

// The value of a polynomial and its first two derivatives.
static inline void taylor(const double* c, int64_t order, double x, double& value, double& first, double& second) {
    value = c[order - 1];
    first = second = 0.0;
    for (int64_t k = order - 2; k >= 0; k--) {
        second = second * x + first;
        first = first * x + value;
        value = value * x + c[k];
    }
    second *= 2.0;
}

// Bernstein coefficients of the two halves of a polynomial, by de Casteljau.
static inline void halve(const double* b, int64_t order, double* left, double* right) {
    if (right != b) memcpy(right, b, order * sizeof(double));
    for (int64_t k = 0; k < order; k++) {
        left[k] = right[0];
        for (int64_t i = 0; i + 1 < order - k; i++) right[i] = 0.5 * (right[i] + right[i + 1]);
    }
}

// The largest of |p| / measure over the rows of each group: row, unit time and ratio. The rows' Bernstein coefficients
// bound them; where that bound beats the best value, a row is halved. With directions (2, rows), negative and positive
// values count by these factors.
static inline int largest_magnitudes(int64_t rows, int64_t order, const double* bernstein, const double* measure,
                                     const int64_t* groups, const double* directions, double rounding,
                                     int64_t* at_row, double* at_unit, double* best) {
    constexpr int64_t MOST_HALVINGS = 48;  // 2^-48 of a piece is less than the spacing of numbers
    struct Part { double start, width; };
    Scratch<double> stack((MOST_HALVINGS + 2) * order);
    Scratch<Part> parts(MOST_HALVINGS + 2);
    if (!stack || !parts) return NO_MEMORY;
    const double smallest = ldexp(1.0, -MOST_HALVINGS);
    for (int pass = 0; pass < 2; pass++)  // the ends of all rows first, so that few rows are halved
        for (int64_t r = 0; r < rows; r++) {
            const double *row = bernstein + r * order, inverse = 1.0 / measure[r];
            const double down = directions ? directions[r] : 1.0, up = directions ? directions[rows + r] : 1.0;
            const int64_t g = groups[r];
            auto ratio = [&](double x) {
                if (isnan(x)) return (double)INFINITY;
                x *= inverse;
                return x < 0.0 ? -x * down : x * up;
            };
            auto see = [&](double x, double unit) {
                const double value = ratio(x);
                if (value > best[g]) { best[g] = value; at_row[g] = r; at_unit[g] = unit; }
            };
            if (pass == 0) { see(row[0], 0.0); see(row[order - 1], 1.0); continue; }
            double most = 0.0;
            for (int64_t i = 0; i < order; i++) { const double x = ratio(row[i]); most = x > most ? x : most; }
            if (!(most > best[g] * (1.0 + rounding))) continue;
            memcpy(stack.data, row, order * sizeof(double));
            parts[0] = {0.0, 1.0};
            for (int64_t top = 1; top > 0;) {
                top--;
                double *b = stack.data + top * order, hull = 0.0;
                const Part part = parts[top];
                for (int64_t i = 0; i < order; i++) { const double x = ratio(b[i]); hull = x > hull ? x : hull; }
                see(b[0], part.start);
                see(b[order - 1], part.start + part.width);
                if (!(hull > best[g] * (1.0 + rounding)) || part.width <= smallest) continue;
                halve(b, order, b + order, b);  // the first half on top: it is looked at next
                parts[top] = {part.start + 0.5 * part.width, 0.5 * part.width};
                parts[top + 1] = {part.start, 0.5 * part.width};
                top += 2;
            }
        }
    return OK;
}

// Bound of |p| by the Bernstein coefficients of eight parts: hardly more than its peak.
static inline double bound_by_parts(const double* b, int64_t order, double* scratch) {
    memcpy(scratch, b, order * sizeof(double));
    for (int64_t n = 1; n < 8; n *= 2)
        for (int64_t q = n - 1; q >= 0; q--) {
            if (q) memcpy(scratch + 2 * q * order, scratch + q * order, order * sizeof(double));
            halve(scratch + 2 * q * order, order, scratch + 8 * order, scratch + (2 * q + 1) * order);
            memcpy(scratch + 2 * q * order, scratch + 8 * order, order * sizeof(double));
        }
    double bound = 0.0;
    for (int64_t i = 0; i < 8 * order; i++) bound = fmax(bound, fabs(scratch[i]));
    return bound;
}

struct Density { double least_share, off_parabola, most_parts, samples_per_radian, fewest_parts; };  // of parts_of

// The number of parts of each piece on which velocities and accelerations are about parabolas; six derivatives.
static inline int count_parts(int64_t pieces, int64_t joints, int64_t order, const double* bernstein,
                              const double* lengths, const double* density, int64_t* parts) {
    const Density& d = *reinterpret_cast<const Density*>(density);
    Scratch<double> peaks(2 * joints), scratch(9 * order);
    if (!peaks || !scratch) return NO_MEMORY;
    const int64_t rows = pieces * joints;
    auto hull = [&](int64_t derivative, int64_t row) {
        const double* b = bernstein + (derivative * rows + row) * order;
        double most = 0.0;
        for (int64_t i = 0; i < order; i++) most = fmax(most, fabs(b[i]));
        return most;
    };
    for (int k = 0; k < 2; k++) {
        double largest = 0.0;
        for (int64_t j = 0; j < joints; j++) {
            double peak = 0.0;
            for (int64_t p = 0; p < pieces; p++) peak = fmax(peak, hull(k + 1, p * joints + j));
            peaks[k * joints + j] = peak;
            largest = fmax(largest, peak);
        }
        for (int64_t j = 0; j < joints; j++)
            peaks[k * joints + j] = fmax(peaks[k * joints + j], d.least_share * largest) + 2.2250738585072014e-308;
    }
    for (int64_t p = 0; p < pieces; p++) {
        double bend = 0.0;
        for (int64_t j = 0; j < joints; j++)
            for (int k = 0; k < 2; k++) bend = fmax(bend, hull(k + 4, p * joints + j) / peaks[k * joints + j]);
        const double half = lengths[p] * cbrt(bend / (9.0 * sqrt(3.0) * d.off_parabola)), of_travel = d.samples_per_radian * lengths[p];
        double most = fmax(fmin(half, 2.0 * d.most_parts), 2.0 * d.fewest_parts);
        for (int64_t j = 0; j < joints; j++) {
            const int64_t row = rows + p * joints + j;
            if (of_travel * hull(1, p * joints + j) > most)
                most = fmax(most, of_travel * bound_by_parts(bernstein + row * order, order, scratch.data));
        }
        parts[p] = (int64_t)ceil(0.5 * most);
    }
    return OK;
}

// The value of a polynomial and its first three derivatives.
static inline void taylor(const double* c, int64_t order, double x, double found[4]) {
    double value = 0.0, first = 0.0, second = 0.0, third = 0.0;
    for (int64_t e = order - 1; e >= 0; e--) {
        third = third * x + second;
        second = second * x + first;
        first = first * x + value;
        value = value * x + c[e];
    }
    found[0] = value; found[1] = first; found[2] = 2.0 * second; found[3] = 6.0 * third;
}

// The motion q(s(t)) at points: s and its first two derivatives (3, points), then q and its derivatives up to order 3 (4, points,
// joints), and q' and q'' by s (2, points, joints). Each point is at a local time of a piece of the time scaling
// s(t), and on a piece of the curve q(s).
static inline void scaled_curve(int64_t joints, int64_t order, int64_t scaling_order, const double* lengths, const double* breakpoints,
                                const double* curve, const double* scaling, int64_t points, const int64_t* of,
                                const int64_t* on, const double* t, double* s, double* q, double* slopes) {
    for (int64_t p = 0; p < points; p++) {
        double law[4], own[4];
        taylor(scaling + of[p] * scaling_order, scaling_order, t[p], law);
        const double v = law[1], a = law[2], x = fmin(fmax(law[0] - breakpoints[on[p]], 0.0), lengths[on[p]]);
        for (int64_t k = 0; k < 3; k++) s[k * points + p] = law[k];
        for (int64_t j = 0; j < joints; j++) {
            taylor(curve + (on[p] * joints + j) * order, order, x, own);
            double* at = q + p * joints + j;
            at[0] = own[0];
            at[points * joints] = own[1] * v;
            at[2 * points * joints] = own[2] * v * v + own[1] * a;
            at[3 * points * joints] = own[3] * v * v * v + 3.0 * own[2] * v * a + own[1] * law[3];
            for (int64_t k = 0; k < 2; k++) slopes[(k * points + p) * joints + j] = own[k + 1];
        }
    }
}
