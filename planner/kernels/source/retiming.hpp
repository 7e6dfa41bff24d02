// The best change of a law of motion within limits that are linear in b, a and c at gridpoints, but for bounds that go with
// 1 / sqrt(b); see planner/time_scaling/retiming.py. Rows and gridpoints are (rows, points) in row order.
#pragma once
#include "quadratic_program.hpp"

// The limits |by_b b + by_a a + by_c c + offset| <= constant + inverse / sqrt(b).
struct RetimingLimits { int64_t count; const double *by_b, *by_a, *by_c, *offset, *constant, *inverse; };

// The integral of size(y) b^power, for each row y = by_b b + by_a a + by_c c + offset. The size is y^2, or |y|, rounded where
// y changes its sign.
struct PathCost { int64_t count; double power, smoothing; bool is_absolute; const double* rows[4]; };

// The duration by its weight, and further costs; `weights` (points) are those of the integral.
struct RetimingObjective {
    static constexpr double LEAST_CURVATURE = 0.05;  // share of its own curvature that is kept where limits are concave
    int64_t points, count;
    const double* weights;
    double time_weight;
    const PathCost* costs;

    // Its value at states (3, points); the slope (3, points) by them, and the curvature (6, points) by bb, ba, bc, aa, ac and
    // cc, less that of 1 / sqrt(b) times `concave` (points), made positive semidefinite; null: not wanted.
    double at(const double* states, double* slope, double* curvature, const double* concave) const {
        const double* s[3] = {states, states + points, states + 2 * points};
        double value = 0.0;
        for (int64_t p = 0; p < points; p++) {
            const double b = s[0][p], root = sqrt(b), w = weights[p];
            double times = 0.0, least_times = 0.0;
            value += time_weight * w / root;
            if (slope) {
                slope[p] = -0.5 * time_weight * w / (b * root);
                slope[points + p] = slope[2 * points + p] = 0.0;
            }
            if (curvature) {
                const double of_times = 0.75 / (b * b * root);
                times = of_times * (time_weight * w - concave[p]);
                least_times = of_times * LEAST_CURVATURE * time_weight * w;
                for (int64_t k = 0; k < 6; k++) curvature[k * points + p] = 0.0;
            }
            for (int64_t c = 0; c < count; c++) {
                const PathCost& cost = costs[c];
                const double power = cost.power, raised = pow(b, power), scale = 2.0 * w * raised;
                double size = 0.0, pull[3] = {0.0, 0.0, 0.0}, bends[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
                for (int64_t r = 0; r < cost.count; r++) {
                    const int64_t at = r * points + p;
                    const double row[3] = {cost.rows[0][at], cost.rows[1][at], cost.rows[2][at]};
                    const double y = row[0] * b + row[1] * s[1][p] + row[2] * s[2][p] + cost.rows[3][at];
                    const double own = cost.is_absolute ? sqrt(y * y + cost.smoothing * cost.smoothing) : y * y;
                    const double stiffness = cost.is_absolute ? 0.5 / own : 1.0, first = row[0] + power * y / b;
                    size += own;
                    for (int64_t k = 0; k < 3; k++) pull[k] += stiffness * y * row[k];
                    bends[0] += stiffness * first * first; bends[1] += stiffness * first * row[1];
                    bends[2] += stiffness * first * row[2]; bends[3] += stiffness * row[1] * row[1];
                    bends[4] += stiffness * row[1] * row[2]; bends[5] += stiffness * row[2] * row[2];
                }
                value += w * size * raised;
                if (slope) {
                    for (int64_t k = 0; k < 3; k++) slope[k * points + p] += scale * pull[k];
                    slope[p] += 0.5 * scale * power * size / b;
                }
                if (curvature) {
                    const double of_power = w * size * raised / (b * b);
                    const double own = -power * (power + 1.0) * of_power, least = LEAST_CURVATURE * of_power;
                    for (int64_t k = 0; k < 6; k++) curvature[k * points + p] += scale * bends[k];
                    curvature[p] += fmax(own + times, least + least_times);
                    times = least_times = 0.0;
                }
            }
            if (curvature && !count) curvature[p] = fmax(times, least_times);
        }
        return value;
    }
};

// A symmetric matrix with two diagonals on either side: the main and the upper ones (3, size).
struct Bands {
    // Replace it by its factors L D L^T. It is positive definite but for rounding.
    static void factorise(double* bands, int64_t size) {
        double *d = bands, *first = bands + size, *second = bands + 2 * size;
        for (int64_t i = 0; i < size; i++) {
            const double one = i > 0 ? first[i - 1] : 0.0, two = i > 1 ? second[i - 2] : 0.0;
            if (i > 0) d[i] -= one * one * d[i - 1];
            if (i > 1) d[i] -= two * two * d[i - 2];
            if (d[i] == 0.0) d[i] = 2.2250738585072014e-308;
            if (i + 1 < size) first[i] = (first[i] - (i > 0 ? one * d[i - 1] * second[i - 1] : 0.0)) / d[i];
            if (i + 2 < size) second[i] /= d[i];
        }
    }
    static void solve(const double* bands, int64_t size, double* x) {
        const double *d = bands, *first = bands + size, *second = bands + 2 * size;
        for (int64_t i = 1; i < size; i++) x[i] -= first[i - 1] * x[i - 1] + (i > 1 ? second[i - 2] * x[i - 2] : 0.0);
        for (int64_t i = 0; i < size; i++) x[i] /= d[i];
        for (int64_t i = size - 2; i >= 0; i--) x[i] -= first[i] * x[i + 1] + (i + 2 < size ? second[i] * x[i + 2] : 0.0);
    }
};

// The linear map (3, 3, gridpoints, intervals) from the unknowns of three neighbouring intervals to b, a and c at gridpoints.
struct SplineMap {
    static constexpr int64_t GRIDPOINTS = 3;
    int64_t intervals;
    const double* maps;
    int64_t points() const { return GRIDPOINTS * intervals; }
    const double* of(int64_t state, int64_t unknown) const { return maps + (3 * state + unknown) * points(); }

    void states(const double* x, double* states) const {
        for (int64_t y = 0; y < 3; y++)
            for (int64_t g = 0; g < GRIDPOINTS; g++)
                for (int64_t i = 0; i < intervals; i++, states++) {
                    const int64_t at = g * intervals + i;
                    *states = of(y, 0)[at] * x[i] + of(y, 1)[at] * x[i + 1] + of(y, 2)[at] * x[i + 2];
                }
    }

    void force(const double* forces, double* total) const {
        memset(total, 0, (intervals + 2) * sizeof(double));
        for (int64_t k = 0; k < 3; k++)
            for (int64_t y = 0; y < 3; y++)
                for (int64_t g = 0; g < GRIDPOINTS; g++)
                    for (int64_t i = 0; i < intervals; i++)
                        total[k + i] += of(y, k)[g * intervals + i] * forces[(y * GRIDPOINTS + g) * intervals + i];
    }

    // The main and the two upper diagonals (3, intervals + 2), by the stiffness (6, points) of bb, ba, bc, aa, ac and cc.
    void bands(const double* stiffness, double* bands) const {
        const int64_t n = intervals, size = n + 2;
        memset(bands, 0, 3 * size * sizeof(double));
        for (int64_t g = 0; g < GRIDPOINTS; g++)
            for (int64_t i = 0; i < n; i++) {
                const int64_t at = g * n + i;
                const double* h = stiffness + at;
                double own[3][3], pulled[3][3];  // of a state by an unknown
                for (int64_t y = 0; y < 3; y++)
                    for (int64_t k = 0; k < 3; k++) own[y][k] = of(y, k)[at];
                const int64_t m = points();
                for (int64_t k = 0; k < 3; k++) {
                    pulled[0][k] = h[0] * own[0][k] + h[m] * own[1][k] + h[2 * m] * own[2][k];
                    pulled[1][k] = h[m] * own[0][k] + h[3 * m] * own[1][k] + h[4 * m] * own[2][k];
                    pulled[2][k] = h[2 * m] * own[0][k] + h[4 * m] * own[1][k] + h[5 * m] * own[2][k];
                }
                for (int64_t k = 0; k < 3; k++)
                    for (int64_t l = k; l < 3; l++)
                        bands[(l - k) * size + k + i] +=
                            own[0][k] * pulled[0][l] + own[1][k] * pulled[1][l] + own[2][k] * pulled[2][l];
            }
    }
};

// What is left of the limits at some b: slacks (2, limits, points) below the upper bounds and above the lower ones, and the
// barrier of strength 1, infinite where a limit is reached.
static inline double retiming_slacks(const RetimingLimits& limits, int64_t points, const double* states, double* roots,
                                     double* products, double* slacks) {
    constexpr int64_t FACTORS_OF_A_LOGARITHM = 4;  // limits whose slacks are multiplied first: a logarithm costs ten products
    const double *b = states, *a = states + points, *c = states + 2 * points;
    double least = INFINITY, height = 0.0;
    for (int64_t p = 0; p < points; p++) roots[p] = 1.0 / sqrt(b[p]);
    for (int64_t l = 0; l < limits.count; l++) {
        const int64_t row = l * points;
        double *above = slacks + row, *below = slacks + (limits.count + l) * points;
        if (l % FACTORS_OF_A_LOGARITHM == 0) for (int64_t p = 0; p < points; p++) products[p] = 1.0;
        for (int64_t p = 0; p < points; p++) {
            const int64_t i = row + p;
            const double value = limits.by_b[i] * b[p] + limits.by_a[i] * a[p] + limits.by_c[i] * c[p] + limits.offset[i];
            const double bound = limits.constant[i] + limits.inverse[i] * roots[p];
            above[p] = bound - value;
            below[p] = bound + value;
            products[p] *= above[p] * below[p];
        }
        for (int64_t p = 0; p < points; p++) {
            least = above[p] < least ? above[p] : least;
            least = below[p] < least ? below[p] : least;
        }
        if (l % FACTORS_OF_A_LOGARITHM == FACTORS_OF_A_LOGARITHM - 1 || l + 1 == limits.count)
            for (int64_t p = 0; p < points; p++) height -= log(products[p]);
    }
    return least > 0.0 ? height : (double)INFINITY;
}

// Durations of parts that are to be met: weights (parts, points), s, in sums of 1 / sqrt(b), and the durations.
struct RequestedDurations { int64_t count; const double *weights, *durations; };

// Solve a small dense system with pivots; the solution replaces the right side.
static inline void solve_dense(double* matrix, double* x, int64_t size) {
    for (int64_t k = 0; k < size; k++) {
        int64_t pivot = k;
        for (int64_t i = k + 1; i < size; i++) if (fabs(matrix[i * size + k]) > fabs(matrix[pivot * size + k])) pivot = i;
        for (int64_t j = 0; pivot != k && j < size; j++) {
            const double swap = matrix[k * size + j];
            matrix[k * size + j] = matrix[pivot * size + j];
            matrix[pivot * size + j] = swap;
        }
        const double swap = x[k]; x[k] = x[pivot]; x[pivot] = swap;
        for (int64_t i = k + 1; i < size; i++) {
            const double factor = matrix[i * size + k] / matrix[k * size + k];
            for (int64_t j = k + 1; j < size; j++) matrix[i * size + j] -= factor * matrix[k * size + j];
            x[i] -= factor * x[k];
        }
    }
    for (int64_t k = size - 1; k >= 0; k--) {
        for (int64_t j = k + 1; j < size; j++) x[k] -= matrix[k * size + j] * x[j];
        x[k] /= matrix[k * size + k];
    }
}

// Find the best unknowns x (intervals + 2), from x on, within all limits; whether nothing better is left within the
// tolerance, and the requested durations are met as closely. A primal-dual interior-point method without slack variables
// (Nocedal and Wright, Numerical Optimization, 2006, ch. 19).
static inline int best_retiming(const SplineMap& map, const RetimingLimits& limits, const RetimingObjective& objective,
                                const RequestedDurations& requested, double tolerance, int64_t most_steps, double* x,
                                int64_t* converged) {
    constexpr double SHARE_TO_BOUNDARY = 0.98;  // of a step: the next one begins inside, too
    constexpr double FIRST_CENTRING = 0.2;      // share of the mean complementarity that is the first barrier
    constexpr double LEAST_CENTRING = 0.15;     // and the next one after a Newton step made in full
    constexpr double BARRIER_KEPT = 0.1;        // share of a step's promised gain: limits are not to be met before all else
    constexpr double LEAST_STEP = 1e-6;         // share of a Newton step: requested durations are not within the limits
    constexpr int64_t MOST_HALVINGS = 20;       // of a step, until it gains enough
    constexpr double ARMIJO = 1e-4;             // share of the promised fall that a step has to make (ibid., eq. 3.4)
    constexpr double ROUNDING = 1e-12;          // of the merit
    const int64_t n = map.intervals + 2, points = map.points(), size = limits.count * points, parts = requested.count;
    Scratch<double> slacks(2 * size), duals(2 * size), inverses(2 * size), changes(2 * size), own_duals(n), own_changes(n);
    Scratch<double> states(3 * points), change(3 * points), forces(3 * points), stiffness(6 * points), concave(points);
    Scratch<double> roots(points), products(points), worst(2 * points), bands(3 * n), force(n), step(n), begin(n), slope(3 * points);
    Scratch<double> slopes(parts * n), yields(parts * n), system(parts * parts), multipliers(parts), missed(parts);
    if (!slacks || !duals || !inverses || !changes || !own_duals || !own_changes || !states || !change || !forces ||
        !stiffness || !concave || !roots || !products || !worst || !bands || !force || !step || !begin || !slope ||
        !slopes || !yields || !system || !multipliers || !missed)
        return NO_MEMORY;
    *converged = 0;
    auto miss = [&] {  // what is missed of the durations; their sum
        double sum = 0.0;
        for (int64_t k = 0; k < parts; k++) {
            missed[k] = dot(requested.weights + k * points, roots.data, points) - requested.durations[k];
            sum += fabs(missed[k]);
        }
        return sum;
    };
    auto logarithms = [&] {
        double sum = 0.0;
        for (int64_t i = 0; i < n; i++) sum += log(x[i]);
        return sum;
    };
    map.states(x, states.data);
    double height = retiming_slacks(limits, points, states.data, roots.data, products.data, slacks.data);
    double value = objective.at(states.data, nullptr, nullptr, nullptr), excess = miss();
    const double count = (double)(2 * size + n);
    for (int64_t i = 0; i < 2 * size; i++) duals[i] = value / count / slacks[i];
    for (int64_t i = 0; i < n; i++) own_duals[i] = value / count / x[i];
    for (int64_t k = 0; k < parts; k++) multipliers[k] = 0.0;
    double centring = FIRST_CENTRING, penalty = 0.0, gain = 0.0;
    for (int64_t number = 0; number < most_steps; number++) {
        const double gap = dot(slacks.data, duals.data, 2 * size) + dot(x, own_duals.data, n);
        bool is_met = fmax(gap, gain) < tolerance * value;
        for (int64_t k = 0; k < parts; k++) is_met = is_met && fabs(missed[k]) <= tolerance * requested.durations[k];
        if (is_met) { *converged = 1; break; }
        const double mu = fmax(centring * gap, BARRIER_KEPT * fmin(gain, value)) / count;
        // Newton's system.
        memset(concave.data, 0, points * sizeof(double));
        memset(forces.data, 0, 3 * points * sizeof(double));
        for (int64_t k = 0; k < parts; k++)
            for (int64_t p = 0; p < points; p++) concave[p] -= multipliers[k] * requested.weights[k * points + p];
        for (int64_t i = 0; i < size; i++) {
            inverses[i] = 1.0 / slacks[i];
            inverses[size + i] = 1.0 / slacks[size + i];
        }
        for (int64_t l = 0; l < limits.count; l++)
            for (int64_t p = 0; p < points; p++)
                concave[p] += (duals[l * points + p] + duals[size + l * points + p]) * limits.inverse[l * points + p];
        objective.at(states.data, slope.data, stiffness.data, concave.data);
        for (int64_t l = 0; l < limits.count; l++)
            for (int64_t p = 0; p < points; p++) {
                const int64_t i = l * points + p;
                const double above = inverses[i], below = inverses[size + i];
                const double narrowing = 0.5 * limits.inverse[i] * roots[p] * roots[p] * roots[p];  // of the bounds, by b
                const double pushed = mu * (below - above), upper = duals[i] * above, lower = duals[size + i] * below;
                const double both = upper + lower, mixed = (upper - lower) * narrowing;
                const double by_b = limits.by_b[i], by_a = limits.by_a[i], by_c = limits.by_c[i];
                forces[p] += pushed * by_b - mu * (above + below) * narrowing;
                forces[points + p] += pushed * by_a;
                forces[2 * points + p] += pushed * by_c;
                stiffness[p] += both * (by_b * by_b + narrowing * narrowing) + 2.0 * mixed * by_b;
                stiffness[points + p] += both * by_b * by_a + mixed * by_a;
                stiffness[2 * points + p] += both * by_b * by_c + mixed * by_c;
                stiffness[3 * points + p] += both * by_a * by_a;
                stiffness[4 * points + p] += both * by_a * by_c;
                stiffness[5 * points + p] += both * by_c * by_c;
            }
        for (int64_t i = 0; i < 3 * points; i++) forces[i] -= slope[i];
        map.bands(stiffness.data, bands.data);
        map.force(forces.data, force.data);
        for (int64_t i = 0; i < n; i++) {
            bands[i] += own_duals[i] / x[i];
            step[i] = force[i] += mu / x[i];
        }
        Bands::factorise(bands.data, n);
        Bands::solve(bands.data, n, step.data);
        gain = dot(force.data, step.data, n);
        double downhill = gain;
        if (parts) {
            memset(forces.data, 0, 3 * points * sizeof(double));
            for (int64_t k = 0; k < parts; k++) {
                for (int64_t p = 0; p < points; p++)
                    forces[p] = -0.5 * requested.weights[k * points + p] * roots[p] * roots[p] * roots[p];
                map.force(forces.data, slopes.data + k * n);
                memcpy(yields.data + k * n, slopes.data + k * n, n * sizeof(double));
                Bands::solve(bands.data, n, yields.data + k * n);
            }
            for (int64_t k = 0; k < parts; k++) {
                for (int64_t i = 0; i < parts; i++) system[k * parts + i] = dot(slopes.data + k * n, yields.data + i * n, n);
                multipliers[k] = dot(slopes.data + k * n, step.data, n) + missed[k];
            }
            solve_dense(system.data, multipliers.data, parts);
            for (int64_t k = 0; k < parts; k++)
                for (int64_t i = 0; i < n; i++) step[i] -= multipliers[k] * yields[k * n + i];
            downhill = gain = dot(force.data, step.data, n);
            for (int64_t k = 0; k < parts; k++) gain -= multipliers[k] * dot(slopes.data + k * n, step.data, n);
        }
        // How far it goes, for the slacks and for the duals.
        map.states(step.data, change.data);
        for (int64_t p = 0; p < 2 * points; p++) worst[p] = 0.0;
        for (int64_t l = 0; l < limits.count; l++)
            for (int64_t p = 0; p < points; p++) {
                const int64_t i = l * points + p;
                const double narrowed = 0.5 * limits.inverse[i] * roots[p] * roots[p] * roots[p] * change[p];
                const double moved =
                    limits.by_b[i] * change[p] + limits.by_a[i] * change[points + p] + limits.by_c[i] * change[2 * points + p];
                for (int64_t side = 0; side < 2; side++) {
                    const int64_t k = side * size + i;
                    const double by = (side ? moved : -moved) - narrowed;
                    const double other = mu * inverses[k] - duals[k] - duals[k] * inverses[k] * by;
                    const double primal = -by * inverses[k], dual = -other / duals[k];
                    changes[k] = other;
                    worst[p] = primal > worst[p] ? primal : worst[p];
                    worst[points + p] = dual > worst[points + p] ? dual : worst[points + p];
                }
            }
        double fastest[2] = {0.0, 0.0};
        for (int64_t k = 0; k < 2; k++)
            for (int64_t p = 0; p < points; p++) fastest[k] = fmax(fastest[k], worst[k * points + p]);
        for (int64_t i = 0; i < n; i++) {
            own_changes[i] = mu / x[i] - own_duals[i] - own_duals[i] / x[i] * step[i];
            fastest[0] = fmax(fastest[0], -step[i] / x[i]);
        }
        double made[2], made_own = longest_step(own_duals.data, own_changes.data, n, SHARE_TO_BOUNDARY);
        for (int64_t k = 0; k < 2; k++) made[k] = fastest[k] <= SHARE_TO_BOUNDARY ? 1.0 : SHARE_TO_BOUNDARY / fastest[k];
        double length = made[0];
        if (!(length >= LEAST_STEP)) break;
        for (int64_t k = 0; k < parts; k++) penalty = fmax(penalty, 2.0 * fabs(multipliers[k]));
        const double merit = value + mu * (height - logarithms()) + penalty * excess, fall = downhill + penalty * excess;
        memcpy(begin.data, x, n * sizeof(double));
        for (int64_t halving = 0;; halving++) {
            for (int64_t i = 0; i < n; i++) x[i] = begin[i] + length * step[i];
            map.states(x, states.data);
            height = retiming_slacks(limits, points, states.data, roots.data, products.data, slacks.data);
            value = objective.at(states.data, nullptr, nullptr, nullptr);
            excess = miss();
            const double there = value + mu * (height - logarithms()) + penalty * excess;
            if (there <= merit - ARMIJO * length * fall + ROUNDING * fabs(merit)) break;
            length *= 0.5;
            if (halving + 1 == MOST_HALVINGS) break;
        }
        centring = fmax(LEAST_CENTRING, sqrt(1.0 - fmin(length, fmin(made[1], made_own))));
        for (int64_t i = 0; i < 2 * size; i++) duals[i] += made[1] * changes[i];
        for (int64_t i = 0; i < n; i++) own_duals[i] += made_own * own_changes[i];
    }
    return OK;
}
