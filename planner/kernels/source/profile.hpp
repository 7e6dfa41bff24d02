// The fastest profile of the path velocity within linear limits, by a backward and a forward pass (Pham and Pham, "A New
// Approach to Time-Optimal Path Parameterization Based on Reachability Analysis", 2018).
//
// x = s'^2 is given at gridpoints, u = s'' is the mean on the interval between two of them: the next x is x + 2 d u. Each
// limit is a row a u + b x + c <= 0 with c < 0, so that standing still keeps them all.
#pragma once
#include "vectors.hpp"

// A limit on u as a function of x, u <= offset + slope x or, as a lower one, u >= offset + slope x.
struct Line { double offset, slope; bool is_upper; };

// The limits on one interval: those on u as lines, all others as one bound on x.
struct Stage { Line* lines; int64_t count; double twice, most; };

// The least and the largest u that keep the limits at x, and how they change with x.
struct Range { double low, low_slope, high, high_slope; };

static inline Range range_of_u(const Stage& stage, double x, double next) {
    const double slope = -1.0 / stage.twice;
    Range range{x * slope, slope, (x - next) * slope, slope};  // the next x is between 0 and `next`
    for (int64_t k = 0; k < stage.count; k++) {
        const Line& line = stage.lines[k];
        const double u = line.offset + line.slope * x;
        if (line.is_upper) {
            if (u < range.high) { range.high = u; range.high_slope = line.slope; }
        } else if (u > range.low) { range.low = u; range.low_slope = line.slope; }
    }
    return range;
}

// The largest x from which some u leads to the next x or less. The room high - low is concave in x, piecewise linear, and
// not negative at x = 0: Newton's steps go down to its root, piece by piece.
static inline double largest_x(const Stage& stage, double x, double next) {
    constexpr double ROUNDING = 1e-13;
    while (x > 0.0) {
        const Range range = range_of_u(stage, x, next);
        const double room = range.high - range.low, slope = range.high_slope - range.low_slope;
        if (room >= -ROUNDING * (fabs(range.high) + fabs(range.low))) break;
        const double lower = x - room / slope;
        if (!(slope < 0.0 && lower > 0.0)) return 0.0;
        if (lower >= x) break;
        x = lower;
    }
    return x;
}

// Rows whose coefficient of u is at most `parallel` of the largest on their interval limit x alone.
static inline void set_stage(Stage& stage, int64_t rows, const double* a, const double* b, const double* c, double parallel) {
    double largest = 0.0;
    for (int64_t k = 0; k < rows; k++) largest = fmax(largest, fabs(a[k]));
    stage.most = INFINITY;
    for (int64_t k = 0; k < rows; k++) {
        if (fabs(a[k]) > parallel * largest) stage.lines[stage.count++] = {-c[k] / a[k], -b[k] / a[k], a[k] > 0.0};
        else if (b[k] > 0.0) stage.most = fmin(stage.most, -c[k] / b[k]);
    }
}

// The largest x at each gridpoint (intervals + 1) from which the rest can be braked in time, and of these the largest that
// can be reached: the fastest profile. x is 0 at rests.
static inline int fastest_profile(int64_t intervals, int64_t rows, const double* lengths, const double* a, const double* b,
                                  const double* c, const double* bounds, const int64_t* rests, double parallel,
                                  double* controllable, double* reached) {
    Scratch<Line> lines(intervals * rows);
    Scratch<Stage> stages(intervals);
    if (!lines || !stages) return NO_MEMORY;
    controllable[intervals] = reached[0] = 0.0;
    for (int64_t i = intervals - 1; i >= 0; i--) {
        Stage& stage = stages[i] = {lines.data + i * rows, 0, 2.0 * lengths[i], 0.0};
        set_stage(stage, rows, a + i * rows, b + i * rows, c + i * rows, parallel);
        controllable[i] = rests[i] ? 0.0 : largest_x(stage, fmin(bounds[i], stage.most), controllable[i + 1]);
    }
    for (int64_t i = 0; i < intervals; i++) {
        const double x = reached[i], next = controllable[i + 1];
        reached[i + 1] = fmin(fmax(x + stages[i].twice * range_of_u(stages[i], x, next).high, 0.0), next);
    }
    return OK;
}
