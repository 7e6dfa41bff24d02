// Velocities and accelerations with which waypoints are passed, near to the fastest; see
// planner/backends/ruckig/via_program.py. On a segment of duration 1 each joint has unknowns: velocity and acceleration at its
// start and at its end, then free numbers. All that is limited is linear in them and in the travel.
#pragma once
#include "quadratic_program.hpp"

struct PassingProblem {
    static constexpr int64_t FIXED = 4, MOST_UNKNOWNS = 16;  // of a joint on a segment; the first are the states at its ends
    int64_t segments, joints, rows, unknowns;
    const double *coefficients, *by_travel;  // (rows, unknowns), (rows)
    const int64_t* powers;                   // (rows), orders of differentiation
    const double *travels, *bounds;          // (segments, joints), (2, segments, joints, rows): upper ones, then lower
    const double *shortest, *costs;          // (segments)
    int64_t slacks() const { return 2 * segments * joints * rows + segments; }
};

// All unknowns: durations, states (waypoints, joints, 2) and free numbers (segments, joints, free), one behind the other.
struct PassingPoint {
    const PassingProblem& in;
    Scratch<double> values;
    explicit PassingPoint(const PassingProblem& in) : in(in), values(size(in)) {}
    static int64_t size(const PassingProblem& in) {
        return in.segments + 2 * (in.segments + 1) * in.joints + in.segments * in.joints * (in.unknowns - in.FIXED);
    }
    double* times() { return values.data; }
    double* state(int64_t waypoint, int64_t joint) { return values.data + in.segments + 2 * (waypoint * in.joints + joint); }
    double* free(int64_t k, int64_t j) {
        return state(in.segments + 1, 0) + (k * in.joints + j) * (in.unknowns - in.FIXED);
    }
    // The unknowns of a joint on a segment, scaled to duration 1 by a duration.
    void scaled(int64_t k, int64_t j, double time, double* u) {
        const double *begin = state(k, j), *end = state(k + 1, j), *own = free(k, j);
        u[0] = time * begin[0]; u[1] = time * time * begin[1];
        u[2] = time * end[0]; u[3] = time * time * end[1];
        for (int64_t i = in.FIXED; i < in.unknowns; i++) u[i] = own[i - in.FIXED];
    }
};

struct PassingSearch {
    static constexpr int64_t FIXED = PassingProblem::FIXED, SIDES = FIXED + 2;  // by the states, the duration, the gradient
    static constexpr int64_t MOST_UNKNOWNS = PassingProblem::MOST_UNKNOWNS, SIDE = MOST_UNKNOWNS;  // columns of a system
    const PassingProblem& in;
    const int64_t segments, joints, rows, unknowns, own, all;  // own: slacks of all joints in one direction
    PassingPoint point, step, there;
    Scratch<double> slacks, duals, left, widened, changes, dual_changes, growth, columns, inner, values;
    Scratch<double> chain_sides, solved, taken, gradient, by_durations, padded;
    Scratch<int64_t> firsts, dense_firsts;
    Envelope chain, dense;

    static int64_t* chain_firsts(int64_t size, int64_t* firsts) {  // blocks of 2 beside the diagonal
        for (int64_t i = 0; firsts && i < size; i++) firsts[i] = i / 2 > 0 ? 2 * (i / 2 - 1) : 0;
        return firsts;
    }
    static int64_t* no_firsts(int64_t size, int64_t* firsts) {
        return firsts ? static_cast<int64_t*>(memset(firsts, 0, size * sizeof(int64_t))) : nullptr;
    }

    explicit PassingSearch(const PassingProblem& in)
        : in(in), segments(in.segments), joints(in.joints), rows(in.rows), unknowns(in.unknowns),
          own(in.segments * in.joints * in.rows), all(in.slacks()), point(in), step(in), there(in), slacks(all), duals(all),
          left(all), widened(all), changes(all), dual_changes(all), growth(2 * own),
          columns(segments * joints * FIXED * SIDES), inner(segments * joints * unknowns * SIDES), values(rows),
          chain_sides(2 * segments * (segments + 1)), solved(2 * segments * joints * (segments + 1)),
          taken(segments * (segments + 1)), gradient(segments), by_durations(segments), padded(rows * MOST_UNKNOWNS),
          firsts(2 * segments), dense_firsts(segments), chain(2 * (segments - 1), chain_firsts(2 * (segments - 1), firsts.data), 8 * segments),
          dense(segments, no_firsts(segments, dense_firsts.data), segments * (segments + 1) / 2) {}
    explicit operator bool() const {
        return point.values && step.values && there.values && slacks && duals && left && widened && changes && dual_changes &&
               growth && columns && inner && values && chain_sides && solved && taken && gradient && by_durations && padded &&
               firsts && dense_firsts && chain && dense;
    }

    // The slacks, flat: those of the upper and the lower limits, then those of the durations.
    void set_slacks(PassingPoint& at, double* slacks) {
        double u[MOST_UNKNOWNS];
        for (int64_t k = 0; k < segments; k++) {
            const double time = at.times()[k], power[4] = {1.0, time, time * time, time * time * time};
            for (int64_t j = 0; j < joints; j++) {
                const int64_t row = (k * joints + j) * rows;
                at.scaled(k, j, time, u);
                for (int64_t r = 0; r < rows; r++) {
                    const double* c = in.coefficients + r * unknowns;
                    double value = in.travels[k * joints + j] * in.by_travel[r];
                    for (int64_t i = 0; i < unknowns; i++) value += c[i] * u[i];
                    slacks[row + r] = in.bounds[row + r] * power[in.powers[r]] - value;
                    slacks[own + row + r] = in.bounds[own + row + r] * power[in.powers[r]] + value;
                }
            }
            slacks[2 * own + k] = time - in.shortest[k];
        }
    }

    // Newton's step towards a barrier, and the changes of the slacks to first order. False: it is too near to a limit for the
    // numbers. The system is condensed, segment by segment and joint by joint, to one for the durations.
    bool newton(double barrier) {
        const int64_t free = unknowns - FIXED, states = 2 * (segments - 1), sides = segments + 1;
        double small[MOST_UNKNOWNS * MOST_UNKNOWNS];
        memset(taken.data, 0, segments * sides * sizeof(double));
        for (int64_t k = 0; k < segments; k++) {
            const double time = point.times()[k], power[4] = {0.0, 1.0, 2.0 * time, 3.0 * time * time};
            const double scale[FIXED] = {time, time * time, time, time * time};
            double stiffness = duals[2 * own + k] / slacks[2 * own + k], slope = in.costs[k] - barrier / slacks[2 * own + k];
            for (int64_t j = 0; j < joints; j++) {
                const int64_t row = (k * joints + j) * rows;
                const double *begin = point.state(k, j), *end = point.state(k + 1, j);
                const double by_time[FIXED] = {begin[0], 2.0 * time * begin[1], end[0], 2.0 * time * end[1]};
                alignas(V) double system[MOST_UNKNOWNS][SIDE + W] = {};  // its lower half, a vector at a time; two right sides
                for (int64_t r = 0; r < rows; r++) {
                    const double* c = padded.data + r * MOST_UNKNOWNS;
                    double moved = 0.0, stiff = 0.0, mixed = 0.0, pushed = 0.0;
                    for (int64_t i = 0; i < FIXED; i++) moved += by_time[i] * c[i];
                    for (int64_t side = 0; side < 2; side++) {
                        const int64_t i = side * own + row + r;
                        const double sign = side ? -1.0 : 1.0, push = barrier / slacks[i], own_stiff = duals[i] / slacks[i];
                        const double grown = growth[i] = in.bounds[i] * power[in.powers[r]] - sign * moved;
                        stiff += own_stiff;
                        mixed -= sign * own_stiff * grown;
                        pushed += sign * push;
                        stiffness += own_stiff * grown * grown;
                        slope -= push * grown;
                    }
                    for (int64_t i = 0; i < unknowns; i++) {
                        const V weighted = splat(stiff * c[i]);
                        for (int64_t l = 0; l <= i; l += W) *(V*)(system[i] + l) += weighted * *(const V*)(c + l);
                        system[i][SIDE] += mixed * c[i];
                        system[i][SIDE + 1] += pushed * c[i];
                    }
                }
                for (int64_t i = 0; i < unknowns; i++) {
                    const double own_scale = i < FIXED ? scale[i] : 1.0;
                    for (int64_t l = 0; l <= i && l < FIXED; l++) system[i][l] *= own_scale * scale[l];
                    for (int64_t l = SIDE; l < SIDE + 2; l++) system[i][l] *= own_scale;
                }
                for (int64_t i = 0; i < unknowns; i++) for (int64_t l = i + 1; l < unknowns; l++) system[i][l] = system[l][i];
                // The free numbers, by Cholesky's factors.
                double* by = inner.data + (k * joints + j) * unknowns * SIDES;  // (free, SIDES)
                for (int64_t i = 0; i < free; i++)
                    for (int64_t l = 0; l <= i; l++) {
                        double rest = system[FIXED + i][FIXED + l];
                        for (int64_t e = 0; e < l; e++) rest -= small[i * free + e] * small[l * free + e];
                        if (i == l && !(rest > 0.0)) return false;
                        small[i * free + l] = i == l ? sqrt(rest) : rest / small[l * free + l];
                    }
                double rest[SIDES];
                auto start = [&](const double* row) {
                    for (int64_t c = 0; c < SIDES; c++) rest[c] = row[c < FIXED ? c : SIDE + c - FIXED];
                };
                auto subtract = [&](double share, const double* row) {
                    for (int64_t c = 0; c < SIDES; c++) rest[c] -= share * row[c];
                };
                for (int64_t i = 0; i < free; i++) {
                    start(system[FIXED + i]);
                    for (int64_t e = 0; e < i; e++) subtract(small[i * free + e], by + e * SIDES);
                    for (int64_t c = 0; c < SIDES; c++) by[i * SIDES + c] = rest[c] / small[i * free + i];
                }
                for (int64_t i = free - 1; i >= 0; i--) {
                    memcpy(rest, by + i * SIDES, sizeof(rest));
                    for (int64_t e = i + 1; e < free; e++) subtract(small[e * free + i], by + e * SIDES);
                    for (int64_t c = 0; c < SIDES; c++) by[i * SIDES + c] = rest[c] / small[i * free + i];
                }
                for (int64_t i = 0; i < FIXED; i++) {
                    start(system[i]);
                    for (int64_t e = 0; e < free; e++) subtract(system[i][FIXED + e], by + e * SIDES);
                    memcpy(columns.data + ((k * joints + j) * FIXED + i) * SIDES, rest, sizeof(rest));
                }
                for (int64_t e = 0; e < free; e++) {
                    stiffness -= system[FIXED + e][SIDE] * by[e * SIDES + FIXED];
                    slope -= system[FIXED + e][SIDE] * by[e * SIDES + FIXED + 1];
                }
            }
            by_durations[k] = stiffness;
            gradient[k] = slope;
        }
        // The states of each joint, those at the ends of the whole given.
        for (int64_t j = 0; j < joints && states; j++) {
            memset(chain.elements.data, 0, 8 * segments * sizeof(double));
            memset(chain_sides.data, 0, states * sides * sizeof(double));
            for (int64_t k = 0; k < segments; k++) {
                const double* of = columns.data + (k * joints + j) * FIXED * SIDES;
                for (int64_t i = 0; i < FIXED; i++) {
                    const int64_t at = 2 * (k - 1) + i;
                    if (at < 0 || at >= states) continue;
                    for (int64_t l = 0; l <= i; l++) if (2 * (k - 1) + l >= 0) chain.row(at)[2 * (k - 1) + l] += of[i * SIDES + l];
                    chain_sides[at * sides + k] += of[i * SIDES + FIXED];
                    chain_sides[at * sides + segments] += of[i * SIDES + FIXED + 1];
                }
            }
            if (!chain.factorise()) return false;
            double* x = solved.data + j * states * sides;
            for (int64_t i = 0; i < states; i++)
                for (int64_t c = 0; c < sides; c++) {
                    double rest = chain_sides[i * sides + c];
                    for (int64_t e = chain.first[i]; e < i; e++) rest -= chain.row(i)[e] * x[e * sides + c];
                    x[i * sides + c] = rest / chain.row(i)[i];
                }
            for (int64_t i = states - 1; i >= 0; i--)
                for (int64_t c = 0; c < sides; c++) {
                    const double value = x[i * sides + c] /= chain.row(i)[i];
                    for (int64_t e = chain.first[i]; e < i; e++) x[e * sides + c] -= chain.row(i)[e] * value;
                }
            for (int64_t k = 0; k < segments; k++)
                for (int64_t i = 0; i < FIXED; i++) {
                    const int64_t at = 2 * (k - 1) + i;
                    if (at < 0 || at >= states) continue;
                    const double side = chain_sides[at * sides + k];
                    for (int64_t c = 0; c < sides; c++) taken[k * sides + c] += side * x[at * sides + c];
                }
        }
        for (int64_t k = 0; k < segments; k++)
            for (int64_t c = 0; c <= k; c++) dense.row(k)[c] = (k == c ? by_durations[k] : 0.0) - taken[k * sides + c];
        if (!dense.factorise()) return false;
        double* faster = step.times();
        for (int64_t k = 0; k < segments; k++) faster[k] = taken[k * sides + segments] - gradient[k];
        dense.solve(faster);
        for (int64_t j = 0; j < joints; j++)
            for (int64_t w = 0; w <= segments; w++)
                for (int64_t i = 0; i < 2; i++) {
                    const bool is_inner = w > 0 && w < segments;
                    const double* x = is_inner ? solved.data + (j * states + 2 * (w - 1) + i) * sides : nullptr;
                    step.state(w, j)[i] = is_inner ? -dot(x, faster, segments) - x[segments] : 0.0;
                }
        for (int64_t k = 0; k < segments; k++) {
            changes[2 * own + k] = faster[k];
            for (int64_t j = 0; j < joints; j++) {
                const double *begin = step.state(k, j), *end = step.state(k + 1, j);
                const double known[SIDES] = {begin[0], begin[1], end[0], end[1], faster[k], 1.0};
                const double* by = inner.data + (k * joints + j) * unknowns * SIDES;
                double u[MOST_UNKNOWNS], *numbers = step.free(k, j);
                for (int64_t e = 0; e < free; e++) {
                    numbers[e] = 0.0;
                    for (int64_t c = 0; c < SIDES; c++) numbers[e] -= by[e * SIDES + c] * known[c];
                }
                step.scaled(k, j, point.times()[k], u);
                for (int64_t r = 0; r < rows; r++) {
                    const int64_t i = (k * joints + j) * rows + r;
                    double change = 0.0;
                    for (int64_t e = 0; e < unknowns; e++) change += in.coefficients[r * unknowns + e] * u[e];
                    changes[i] = growth[i] * faster[k] - change;
                    changes[own + i] = growth[own + i] * faster[k] + change;
                }
            }
        }
        return true;
    }

    void run() {
        constexpr double SHARE_TO_BOUNDARY = 0.98;  // of a step: the next one begins inside, too
        constexpr int64_t MOST_STEPS = 30, MOST_SHORTENINGS = 20;
        constexpr double GAP = 0.05;             // to the optimum, relative
        constexpr double FIRST_SHARE = 0.5;      // share of the duration that the sum of all barriers is at first
        constexpr double FIRST_CENTRING = 0.2;   // share of the mean complementarity that is the first barrier
        constexpr double LEAST_CENTRING = 0.1;   // and the next one after a Newton step made in full
        constexpr double KEPT = 0.01;            // share of the distance to a limit that a step must leave
        constexpr double SHORTER = 0.7;          // factor by which a step is shortened that leaves less
        constexpr double MARGIN = 0.05;          // room that a limit is widened to leave where it leaves next to none
        constexpr double NO_ROOM = 1e-3;         // share of that room below which it does
        const int64_t unknown = PassingPoint::size(in);
        memset(padded.data, 0, rows * MOST_UNKNOWNS * sizeof(double));  // the coefficients, so that their rows are vectors
        for (int64_t r = 0; r < rows; r++)
            memcpy(padded.data + r * MOST_UNKNOWNS, in.coefficients + r * unknowns, unknowns * sizeof(double));
        set_slacks(point, slacks.data);
        for (int64_t k = 0; k < segments; k++) {
            const double time = point.times()[k], power[4] = {0.0, time, time * time, time * time * time};
            for (int64_t side = 0; side < 2; side++)
                for (int64_t r = 0; r < joints * rows; r++) {
                    const int64_t i = side * own + k * joints * rows + r, order = in.powers[r % rows];
                    const double margin = order ? MARGIN * in.bounds[i] * power[order] : MARGIN;
                    widened[i] = slacks[i] < NO_ROOM * margin ? margin - slacks[i] : 0.0;
                }
            widened[2 * own + k] = slacks[2 * own + k] < 0.0 ? -slacks[2 * own + k] : 0.0;
        }
        for (int64_t i = 0; i < all; i++) slacks[i] += widened[i];
        const double first = FIRST_SHARE * dot(in.costs, point.times(), segments) / (double)all;
        for (int64_t i = 0; i < all; i++) duals[i] = first / slacks[i];
        double centring = FIRST_CENTRING;
        for (int64_t number = 0; number < MOST_STEPS; number++) {
            const double gap = dot(slacks.data, duals.data, all), barrier = centring * gap / (double)all;
            if (gap < GAP * dot(in.costs, point.times(), segments) || !newton(barrier)) return;
            for (int64_t i = 0; i < all; i++)
                dual_changes[i] = barrier / slacks[i] - duals[i] - duals[i] / slacks[i] * changes[i];
            double length = longest_step(slacks.data, changes.data, all, SHARE_TO_BOUNDARY);
            const double made = longest_step(duals.data, dual_changes.data, all, SHARE_TO_BOUNDARY);
            // What is left is not linear in the durations: the step is shortened until enough is.
            bool is_kept = false;
            for (int64_t shortening = 0; shortening < MOST_SHORTENINGS && !is_kept; shortening++) {
                for (int64_t i = 0; i < unknown; i++) there.values[i] = point.values[i] + length * step.values[i];
                set_slacks(there, left.data);
                is_kept = true;
                for (int64_t i = 0; i < all; i++) is_kept &= left[i] + widened[i] > KEPT * slacks[i];
                if (!is_kept) length *= SHORTER;
            }
            if (!is_kept) return;
            centring = fmax(LEAST_CENTRING, sqrt(1.0 - fmin(length, made)));
            for (int64_t i = 0; i < all; i++) {
                const double room = left[i] + widened[i], drawn_in = fmin(widened[i], 0.5 * room);
                widened[i] -= drawn_in;
                slacks[i] = room - drawn_in;
                duals[i] += made * dual_changes[i];
            }
            memcpy(point.values.data, there.values.data, unknown * sizeof(double));
        }
    }
};
