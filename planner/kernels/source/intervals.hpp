// Curves cut into intervals by gridpoints: more of them where a curve turns, and next to rest.
#pragma once
#include "polynomials.hpp"

// Pieces of curves, each on a segment and of a group of segments from rest to rest, ascending.
struct Curves {
    int64_t pieces, joints, order;
    const double *lengths, *coefficients;
    const int64_t *segments, *groups;
};

// The numbers of `cut` in planner/backends/toppra/intervals.py.
struct Cutting { double fewest, turn, least, of_run, most, at_rest, rounding; };

constexpr int TURNS = 5;  // points of a piece, evenly spaced, where its turn is measured

// The turn of the direction of a piece, with joints measured by weights.
static inline double turn_of(const Curves& curves, int64_t i, const double* weights, double rounding) {
    double speeds[TURNS], bends[TURNS], fastest = 0.0, sharpest = 0.0, turn = 0.0;
    for (int p = 0; p < TURNS; p++) {
        double speed = 0.0, bend = 0.0, value, first, second;
        for (int64_t j = 0; j < curves.joints; j++) {
            const double* c = curves.coefficients + (i * curves.joints + j) * curves.order;
            taylor(c, curves.order, (double)p / (TURNS - 1) * curves.lengths[i], value, first, second);
            const double v = first / weights[j], b = second / weights[j];
            speed += v * v;
            bend += b * b;
        }
        fastest = fmax(fastest, speeds[p] = sqrt(speed));
        sharpest = fmax(sharpest, bends[p] = sqrt(bend));
    }
    for (int p = 0; p < TURNS; p++)
        if (bends[p] > sqrt(rounding) * sharpest) turn += bends[p] / fmax(speeds[p], rounding * fastest);
    return turn / TURNS * curves.lengths[i];
}

static inline int cut_curves(const Curves& curves, int64_t segments, const double* weights, const Cutting& rule,
                             int64_t* rows, double* starts, double* ends, int64_t& count) {
    Scratch<double> spans(segments), runs(curves.pieces);
    if (!spans || !runs) return NO_MEMORY;
    for (int64_t k = 0; k < segments; k++) spans[k] = 0.0;
    for (int64_t i = 0; i < curves.pieces; i++) runs[i] = 0.0;
    for (int64_t i = 0; i < curves.pieces; i++) {
        spans[curves.segments[i]] += curves.lengths[i];
        runs[curves.groups[i]] += curves.lengths[i];
    }
    count = 0;
    for (int64_t i = 0; i < curves.pieces; i++) {
        const double length = curves.lengths[i];
        const bool first = i == 0 || curves.groups[i - 1] != curves.groups[i];
        const bool last = i == curves.pieces - 1 || curves.groups[i + 1] != curves.groups[i];
        const double turns = turn_of(curves, i, weights + curves.segments[i] * curves.joints, rule.rounding) / (rule.turn * rule.least);
        const double share = fmax(length / spans[curves.segments[i]], rule.of_run / rule.least * length / runs[curves.groups[i]]);
        const double parts = fmin(fmax(ceil(rule.fewest * fmax(turns, share) - rule.rounding), 1.0), rule.most);
        // An interval next to rest is split into parts of about equal time.
        auto near = [&](double k) { return k / rule.at_rest * (k / rule.at_rest) / fmax(parts, first && last ? 2.0 : 1.0); };
        double at = 0.0;
        auto add = [&](double share) {
            if (!(share > at)) return;
            rows[count] = i;
            starts[count] = at;
            ends[count++] = at = share;
        };
        for (double k = 1.0; first && k < rule.at_rest; k += 1.0) add(near(k));
        for (double k = 1.0; k < parts; k += 1.0) add(k / parts);
        for (double k = rule.at_rest - 1.0; last && k > 0.0; k -= 1.0) add(1.0 - near(k));
        add(1.0);
    }
    return OK;
}
