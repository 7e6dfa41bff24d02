// Integrals over time of the squares of torques, between bounds: the square of the polynomial of a Taylor model is integrated
// exactly, and its remainder bounds the difference. Intervals are halved where that is not narrow enough.
#pragma once
#include "enclosures.hpp"
#include "clearance.hpp"
#include "sampled_peaks.hpp"

struct TorqueSquares {
    static constexpr double START = 1.0;       // travel of all joints together, rad or m, on half of a first interval
    static constexpr double NARROWEST = 1e-9;  // half width of unit time that is halved no more
    struct Interval { int64_t piece; double middle, half; };
    int64_t joints;
    const Link* links;
    const Load& load;
    const Pieces& motion;
    const double *bernstein, *tolerance;  // (joints,): widths of the bounds for each second
    double *lower, *upper;
    double most_intervals;
    List<Interval> open;
    Scratch<TurnedBody> bodies;
    Scratch<Taylor> states, forces;
    Scratch<V> shifted;

    TorqueSquares(int64_t joints, const double* links, const double* load, const Pieces& motion, const double* bernstein,
                  const double* tolerance, double most_intervals, double* lower, double* upper)
        : joints(joints), links(reinterpret_cast<const Link*>(links)), load(*reinterpret_cast<const Load*>(load)), motion(motion), bernstein(bernstein),
          tolerance(tolerance), lower(lower), upper(upper), most_intervals(most_intervals), bodies(joints),
          states(3 * joints), forces(joints), shifted(2 * motion.order) {}

    int run() {
        for (int64_t p = 0; p < motion.pieces; p++) {
            double travel = 0.0;
            for (int64_t j = 0; j < joints; j++) {
                const double* b = bernstein + (p * joints + j) * motion.order;
                double steepest = 0.0;
                for (int64_t k = 1; k < motion.order; k++) steepest = fmax(steepest, fabs(b[k] - b[k - 1]));
                travel += steepest * (double)(motion.order - 1);
            }
            const double wanted = ceil(fmax(travel / (2.0 * START), 1.0));
            if (!(wanted + (double)open.count <= most_intervals)) return TOO_MANY;
            for (int64_t k = 0; k < (int64_t)wanted; k++) {
                if (!open.push()) return NO_MEMORY;
                open[open.count - 1] = {p, ((double)k + 0.5) / wanted, 0.5 / wanted};
            }
        }
        for (double spent = 0.0; open.count > 0; spent += (double)W) {
            if (spent > most_intervals) return TOO_MANY;
            Interval now[W];
            const int64_t used = open.count < W ? open.count : W;
            for (int64_t l = 0; l < W; l++) now[l] = open[open.count - 1 - (l < used ? l : used - 1)];
            open.count -= used;
            if (!integrate(now, used)) return NO_MEMORY;
        }
        return OK;
    }

    bool integrate(const Interval* now, int64_t used) {
        Lanes at;
        for (int l = 0; l < W; l++) {
            at.piece[l] = now[l].piece;
            at.middle[l] = now[l].middle;
            at.half[l] = now[l].half;
        }
        for (int64_t j = 0; j < joints; j++) {
            Taylor of[3];
            states_of(motion, at, j, 3, shifted.data, of);
            for (int d = 0; d < 3; d++) states[d * joints + j] = of[d];
            TurnedBody& body = bodies[j];
            body.link = links + j;
            body.q = of[0];
            sine_cosine(of[0], body.s, body.c);
        }
        torques<true, true, true>(joints, links, load, bodies.data, states.data + joints, states.data + 2 * joints, forces.data);
        for (int64_t l = 0; l < used; l++) {
            const double seconds = 2.0 * now[l].half * motion.lengths[now[l].piece];
            bool is_narrow = true;
            for (int pass = 0; pass < 2; pass++) {
                if (pass && !is_narrow && now[l].half > NARROWEST) {
                    const double half = 0.5 * now[l].half;
                    for (double way = -1.0; way <= 1.0; way += 2.0) {
                        if (!open.push()) return false;
                        open[open.count - 1] = {now[l].piece, now[l].middle + way * half, half};
                    }
                    break;
                }
                for (int64_t j = 0; j < joints; j++) {
                    double square = 0.0, size = 0.0;  // the mean of p^2 for x from -1 to 1
                    for (int i = 0; i < TERMS; i++) {
                        size += fabs(forces[j].c[i][l]);
                        for (int k = i % 2; k < TERMS; k += 2) square += forces[j].c[i][l] * forces[j].c[k][l] / (double)(i + k + 1);
                    }
                    const double rounding = 256.0 * UNIT * size * size, rest = forces[j].rest[l] * OF_SUMS;
                    const double off = rest * (2.0 * sqrt(fmax(square + rounding, 0.0)) + rest) * (1.0 + 1e-12) + rounding;
                    if (!pass) { is_narrow = is_narrow && 2.0 * off <= tolerance[j]; continue; }
                    lower[j] += seconds * fmax(square - off, 0.0) * (1.0 - 1e-14);
                    upper[j] += isnan(off) ? (double)INFINITY : seconds * (square + off) * (1.0 + 1e-14);
                }
            }
        }
        return true;
    }
};
