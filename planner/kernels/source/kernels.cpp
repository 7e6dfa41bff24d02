// The C interface of the kernels: arrays in, arrays out, and a code that says what failed. All arrays are in row order.
#include "bounded_peaks.hpp"
#include "cubics.hpp"
#include "descent.hpp"
#include "intervals.hpp"
#include "layers.hpp"
#include "linear_limits.hpp"
#include "orders.hpp"
#include "passing.hpp"
#include "polynomials.hpp"
#include "profile.hpp"
#include "proof.hpp"
#include "quadratic_program.hpp"
#include "retiming.hpp"
#include "sampled_peaks.hpp"
#include "serial_chain.hpp"
#include "splines.hpp"
#include "torque_squares.hpp"
#if defined(__x86_64__)
#include <cpuid.h>
#endif

extern "C" {

// Whether the processor and the system have what x86-64-v3 adds: AVX2, FMA, BMI, F16C, LZCNT, MOVBE.
int runs_x86_64_v3() {
#if defined(__x86_64__)
    unsigned a, b, c, d, low, high;
    if (!__get_cpuid(1, &a, &b, &c, &d)) return 0;
    const unsigned first = bit_FMA | bit_MOVBE | bit_OSXSAVE | bit_AVX | bit_F16C;
    if ((c & first) != first) return 0;
    __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    if ((low & 6) != 6) return 0;  // the system keeps the wide registers
    if (!__get_cpuid_count(7, 0, &a, &b, &c, &d)) return 0;
    const unsigned second = bit_AVX2 | bit_BMI | bit_BMI2;
    if ((b & second) != second) return 0;
    return __get_cpuid(0x80000001, &a, &b, &c, &d) && (c & bit_LZCNT);
#else
    return 0;
#endif
}

int inverse_dynamics(int64_t joints, const double* links, const double* load, int64_t states, const double* q,
                     const double* v, const double* a, double* tau) {
    Chain chain(joints, links, load);
    if (!chain) return NO_MEMORY;
    for (int64_t i = 0; i < states; i += W) {
        const int64_t at = i * joints, left = states - i;
        load_states(q + at, joints, left, chain.state(0));
        load_states(v + at, joints, left, chain.state(1));
        load_states(a + at, joints, left, chain.state(2));
        place(chain, chain.state(0));
        torques<true, true, true>(chain, chain.state(1), chain.state(2), chain.state(3));
        store_states(chain.state(3), joints, left, tau + at);
    }
    return OK;
}

int path_dynamics(int64_t joints, const double* links, const double* load, int64_t points, const double* q,
                  const double* first, const double* second, double* inertia, double* centripetal, double* still) {
    Chain chain(joints, links, load);
    if (!chain) return NO_MEMORY;
    for (int64_t i = 0; i < points; i += W) {
        const int64_t at = i * joints, left = points - i;
        load_states(q + at, joints, left, chain.state(0));
        load_states(first + at, joints, left, chain.state(1));
        load_states(second + at, joints, left, chain.state(2));
        place(chain, chain.state(0));
        torques<false, true, false>(chain, nullptr, chain.state(1), chain.state(3));
        store_states(chain.state(3), joints, left, inertia + at);
        torques<true, true, false>(chain, chain.state(1), chain.state(2), chain.state(3));
        store_states(chain.state(3), joints, left, centripetal + at);
        torques<false, false, true>(chain, nullptr, nullptr, chain.state(3));
        store_states(chain.state(3), joints, left, still + at);
    }
    return OK;
}

// Bounds (states, joints) on the torques of a chain at all positions, see torque_magnitudes.
int torque_magnitudes(int64_t joints, const double* rows, int64_t states, const double* v, const double* a, double* tau) {
    Scratch<double> scratch(4 * joints);
    if (!scratch) return NO_MEMORY;
    double *speeds = scratch.data + 2 * joints, *gains = speeds + joints;
    for (int64_t i = 0; i < states * joints; i += joints) {
        for (int64_t j = 0; j < joints; j++) { speeds[j] = fabs(v[i + j]); gains[j] = fabs(a[i + j]); }
        torque_magnitudes(joints, reinterpret_cast<const Magnitude*>(rows), speeds, gains, scratch.data, tau + i);
    }
    return OK;
}

// Differences (states) of derivatives of the tool by following errors (3, joints), see tool_difference; `rates` is (states, order, joints).
int tool_differences(int64_t joints, int64_t tool_joints, const double* following, int64_t order, int64_t is_angular, int64_t states,
                     const double* rates, double* differences) {
    const FollowingErrors errors{following, following + joints, following + 2 * joints};
    for (int64_t i = 0; i < states; i++)
        differences[i] = tool_difference(errors, tool_joints, (int)order, is_angular != 0, rates + i * order * joints, joints);
    return OK;
}

// Positions (states, 3) of a point, rotations (states, 3, 3) of the tip and Jacobians (states, 6, joints) unless null.
int reached(int64_t joints, const double* frames, const double* point, int64_t states, const double* q, double* positions,
            double* rotations, double* jacobians) {
    const Arm arm{joints, reinterpret_cast<const ArmFrame*>(frames), point};
    return reach_all(arm, states, q, positions, rotations, jacobians);
}

// Derivatives of an order, 1 to 3, by time of a point's position and of the tip's turn, (states, 3) each.
int tip_rates(int64_t joints, const double* frames, const double* point, int64_t states, int64_t order, const double* q,
              const double* v, const double* a, const double* j, double* linear, double* angular) {
    const Arm arm{joints, reinterpret_cast<const ArmFrame*>(frames), point};
    const double* motion[3] = {v, a, j};
    if (order == 1) return rates_all<1>(arm, states, q, motion, linear, angular);
    if (order == 2) return rates_all<2>(arm, states, q, motion, linear, angular);
    return rates_all<3>(arm, states, q, motion, linear, angular);
}

// Levenberg-Marquardt from starts (count, joints), `each` of them to every target.
int descend(int64_t joints, const double* frames, const double* point, int64_t count, int64_t each, const double* positions,
            const double* rotations, const double* lower, const double* upper, int64_t patience, int64_t most, double enough,
            const double* starts, double* errors, double* ends) {
    const Arm arm{joints, reinterpret_cast<const ArmFrame*>(frames), point};
    const Terms terms{lower, upper, patience, most, enough};
    return descend_all(arm, terms, {positions, rotations}, count, each, starts, errors, ends);
}

int derivatives(int64_t pieces, int64_t joints, int64_t order, int64_t count, const double* lengths,
                const double* coefficients, double* unit, double* bernstein) {
    return unit_derivatives(pieces, joints, order, count, lengths, coefficients, unit, bernstein);
}

// Values (count, samples, joints) of polynomials (count, pieces, joints, order) at unit times of pieces.
int evaluate(int64_t count, int64_t pieces, int64_t joints, int64_t order, const double* coefficients, int64_t samples,
             const int64_t* piece, const double* unit, double* values) {
    for (int64_t d = 0; d < count; d++)
        for (int64_t i = 0; i < samples; i++)
            for (int64_t j = 0; j < joints; j++)
                *values++ = horner(coefficients + ((d * pieces + piece[i]) * joints + j) * order, order, unit[i]);
    return OK;
}

// Polynomials (rows, order) of x + by (rows).
int shift(int64_t rows, int64_t order, const double* coefficients, const double* by, double* shifted) {
    memcpy(shifted, coefficients, rows * order * sizeof(double));
    for (int64_t r = 0; r < rows; r++, shifted += order)
        if (by[r] != 0.0)
            for (int64_t k = 0; k < order; k++)
                for (int64_t e = order - 2; e >= k; e--) shifted[e] += by[r] * shifted[e + 1];
    return OK;
}

// Values and two derivatives (3, points, pieces, joints) of polynomials at shares (points) of pieces.
int states(int64_t pieces, int64_t joints, int64_t order, const double* lengths, const double* coefficients,
           int64_t points, const double* shares, double* values) {
    const int64_t size = points * pieces * joints;
    for (int64_t p = 0; p < points; p++)
        for (int64_t i = 0; i < pieces; i++)
            for (int64_t j = 0; j < joints; j++, values++) {
                double value, first, second;
                taylor(coefficients + (i * joints + j) * order, order, shares[p] * lengths[i], value, first, second);
                values[0] = value;
                values[size] = first;
                values[2 * size] = second;
            }
    return OK;
}

int follow_scaling(int64_t joints, int64_t order, int64_t scaling_order, const double* lengths,
                   const double* breakpoints, const double* curve, const double* scaling, int64_t points, const int64_t* of,
                   const int64_t* on, const double* t, double* s, double* q, double* slopes) {
    scaled_curve(joints, order, scaling_order, lengths, breakpoints, curve, scaling, points, of, on, t, s, q, slopes);
    return OK;
}

// Limits of joints at points, in the first rows of `parts` (6, rows, points).
int joint_rows(int64_t points, int64_t joints, int64_t width, int64_t rows, const int64_t* at, const double* velocity,
               const double* acceleration, const double* jerk, const double* motion, const double* speeds, double* parts) {
    set_joint_rows({points, joints, width, at, velocity, acceleration, jerk}, rows, motion, speeds, parts);
    return OK;
}

// The linear map (3, 3, gridpoints, intervals) from the unknowns of a retiming to its states.
int spline_maps(int64_t intervals, const double* widths, int64_t begins_evenly, double* maps) {
    set_spline_maps(intervals, widths, begins_evenly, maps);
    return OK;
}

int retimed(int64_t pieces, int64_t order, const double* widths, const double* scaling, const double* unknowns,
                   int64_t count, const double* gauss, double* lengths, double* quintics) {
    retime_scaling(pieces, order, widths, scaling, unknowns, count, gauss, lengths, quintics);
    return OK;
}

// Local times (count) up to which ascending polynomials (count, order) stay below values, by bisection from 0 to lengths.
int arrivals(int64_t count, int64_t order, const double* coefficients, const double* lengths, const double* values,
             int64_t bisections, double* times) {
    for (int64_t i = 0; i < count; i++) {
        double low = 0.0, high = lengths[i];
        for (int64_t k = 0; k < bisections; k++) {
            const double middle = (low + high) / 2.0;
            (horner(coefficients + i * order, order, middle) < values[i] ? low : high) = middle;
        }
        times[i] = high;
    }
    return OK;
}

// The largest factors (points) on b with which limits are kept.
int scales(int64_t points, int64_t limits, const double* by_b, const double* by_a, const double* by_c, const double* offset,
           const double* constant, const double* inverse, const double* states, double* scales) {
    return set_scales({limits, by_b, by_a, by_c, offset, constant, inverse}, points, states, scales);
}

// A smooth start (intervals + 2) for the fastest retiming.
int start_of_retiming(int64_t intervals, const double* maps, int64_t limits, const double* by_b, const double* by_a,
                      const double* by_c, const double* offset, const double* constant, const double* inverse,
                      const double* weights, double largest, double worth, int64_t windows, const int64_t* reaches, double* x) {
    return smooth_start({intervals, maps}, {limits, by_b, by_a, by_c, offset, constant, inverse}, weights,
                        {largest, worth, windows, reaches}, x);
}

int extrema(int64_t rows, int64_t order, const double* bernstein, const double* measure, const int64_t* groups,
            const double* directions, double rounding, int64_t* at_row, double* at_unit, double* best) {
    return largest_magnitudes(rows, order, bernstein, measure, groups, directions, rounding, at_row, at_unit, best);
}

int spline(int64_t degree, int64_t segments, int64_t joints, const double* positions, const double* durations,
           const double* velocities, const int64_t* given, double* unit, double* ends) {
    const auto of_degree = degree == 3 ? interpolate<1> : interpolate<2>;
    return of_degree(segments, joints, positions, durations, velocities, given, unit, ends);
}

int spline_sensitivities(int64_t degree, int64_t segments, int64_t joints, const double* durations, const int64_t* given,
                         const double* ends, int64_t points, const int64_t* segment, const int64_t* joint,
                         const int64_t* order, const double* u, double* slopes) {
    const auto of_degree = degree == 3 ? spline_slopes<1> : spline_slopes<2>;
    return of_degree(segments, joints, durations, given, ends, points, segment, joint, order, u, slopes);
}

// Peaks of a spline: `indices` (3, room) are their segments, joints and orders, `numbers` (4, room) their unit times, values,
// excesses and weights.
int peaks_of_spline(int64_t degree, int64_t segments, int64_t joints, const double* durations, const int64_t* given,
                    const double* unit, const double* span, int64_t rates, const double* lower, const double* upper,
                    const double* position, const double* search, int64_t room, int64_t* indices, double* numbers,
                    int64_t* count) {
    const SplineLimits limits{rates, lower, upper, position, search[0], search[1], search[2], search[3], (int64_t)search[4]};
    SplinePeaks peaks{0, indices, indices + room, indices + 2 * room, numbers, numbers + room, numbers + 2 * room, numbers + 3 * room};
    const auto of_degree = degree == 3 ? spline_peaks<1> : spline_peaks<2>;
    const int code = of_degree(segments, joints, durations, given, unit, span, limits, peaks);
    *count = peaks.count;
    return code;
}

// Durations (segments) and states (segments + 1, joints, 2) are where the search begins, and where it ends.
int pass_waypoints(int64_t segments, int64_t joints, int64_t rows, int64_t unknowns, const double* coefficients,
                   const double* by_travel, const int64_t* powers, const double* travels, const double* bounds,
                   const double* shortest, const double* costs, double* times, double* states) {
    const PassingProblem in{segments, joints, rows, unknowns, coefficients, by_travel, powers, travels, bounds, shortest, costs};
    PassingSearch search(in);
    if (!search) return NO_MEMORY;
    const int64_t bytes = 2 * (segments + 1) * joints * sizeof(double);
    memset(search.point.values.data, 0, PassingPoint::size(in) * sizeof(double));
    memcpy(search.point.times(), times, segments * sizeof(double));
    memcpy(search.point.state(0, 0), states, bytes);
    search.run();
    memcpy(times, search.point.times(), segments * sizeof(double));
    memcpy(states, search.point.state(0, 0), bytes);
    return OK;
}

// Motions in phases of constant jerk as cubics on common pieces of all joints; `counts` (motions) are their numbers of pieces.
int cubics(int64_t motions, int64_t joints, int64_t phases, const double* position, const double* velocity,
           const double* acceleration, const double* jerk, const double* times, const double* travels,
           const double* end_velocity, const double* end_acceleration, double rounding, int64_t* counts, double* lengths,
           double* coefficients) {
    return read_cubics({motions, joints, phases, position, velocity, acceleration, jerk, times, travels, end_velocity,
                        end_acceleration, rounding}, counts, lengths, coefficients);
}

int minimise(int64_t variables, int64_t count, const double* cost, const double* curvature, const double* matrix,
             const double* bounds, const double* lower, const double* upper, const double* gap, double* x) {
    return quadratic_program(variables, count, cost, curvature, matrix, bounds, lower, upper, gap, x);
}

// Costs of retiming by their numbers of rows, powers, roundings (0: squares) and rows (4, rows, points), one behind the other.
static int read_costs(int64_t points, int64_t costs, const int64_t* rows, const double* powers, const double* smoothing,
                      const double* coefficients, Scratch<PathCost>& read) {
    if (!read) return NO_MEMORY;
    for (int64_t c = 0; c < costs; c++) {
        read[c] = {rows[c], powers[c], smoothing[c], smoothing[c] > 0.0, {}};
        for (int64_t k = 0; k < 4; k++, coefficients += rows[c] * points) read[c].rows[k] = coefficients;
    }
    return OK;
}

int retiming_objective(int64_t points, const double* weights, double time_weight, int64_t costs, const int64_t* rows,
                       const double* powers, const double* smoothing, const double* coefficients, const double* states,
                       const double* concave, double* value, double* slope, double* curvature) {
    Scratch<PathCost> read(costs);
    if (read_costs(points, costs, rows, powers, smoothing, coefficients, read)) return NO_MEMORY;
    *value = RetimingObjective{points, costs, weights, time_weight, read.data}.at(states, slope, curvature, concave);
    return OK;
}

int retime(int64_t intervals, const double* maps, int64_t limits, const double* by_b, const double* by_a, const double* by_c,
           const double* offset, const double* constant, const double* inverse, const double* weights, double time_weight,
           int64_t costs, const int64_t* rows, const double* powers, const double* smoothing, const double* coefficients,
           int64_t parts, const double* part_weights, const double* durations, double tolerance, int64_t steps, double* x,
           int64_t* converged) {
    const SplineMap map{intervals, maps};
    Scratch<PathCost> read(costs);
    if (read_costs(map.points(), costs, rows, powers, smoothing, coefficients, read)) return NO_MEMORY;
    return best_retiming(map, {limits, by_b, by_a, by_c, offset, constant, inverse},
                         {map.points(), costs, weights, time_weight, read.data}, {parts, part_weights, durations}, tolerance,
                         steps, x, converged);
}

int parts(int64_t pieces, int64_t joints, int64_t order, const double* bernstein, const double* lengths,
          const double* density, int64_t* parts) {
    return count_parts(pieces, joints, order, bernstein, lengths, density, parts);
}

// Intervals of pieces of curves: their rows and shares of these, whose number goes into `found`.
int cut(int64_t pieces, int64_t joints, int64_t order, const double* lengths, const double* coefficients,
        const int64_t* segment, const int64_t* groups, int64_t segments, const double* weights, const double* rule,
        int64_t* rows, double* starts, double* ends, int64_t* found) {
    const Curves curves{pieces, joints, order, lengths, coefficients, segment, groups};
    return cut_curves(curves, segments, weights, *reinterpret_cast<const Cutting*>(rule), rows, starts, ends, *found);
}

int path_limits(int64_t intervals, int64_t joints, int64_t rows, const double* first, const double* second,
                const int64_t* segments, const double* slower, const double* middle, const double* half, const double* lower,
                const double* upper, const double* by_u, const double* by_x, const double* held, const double* row_middle,
                const double* row_half, const double* used, const double* numbers, double* per_u, double* per_x, double* rest,
                double* bounds) {
    const LimitRows given{joints, rows, middle, half, lower, upper, by_u, by_x, held, row_middle, row_half, used, numbers};
    set_limits(given, intervals, segments, first, second, slower, per_u, per_x, rest, bounds);
    return OK;
}

int profile(int64_t intervals, int64_t count, const double* lengths, const double* per_u, const double* per_x,
            const double* rest, const double* bounds, const int64_t* throughout, const int64_t* rests, double* x) {
    return fastest_profile({intervals, count, lengths, per_u, per_x, rest, bounds}, throughout, rests, x);
}

// The bends of a profile, and the next intervals (up to `rule` parts of each), whose number goes into `found`.
int judge(int64_t intervals, int64_t count, const double* lengths, const double* per_u, const double* per_x,
          const double* rest, const double* bounds, const double* rule, const int64_t* constant, const int64_t* groups,
          const double* x, int64_t may_split, int64_t is_first, double* bends, int64_t* rows, double* starts, double* ends,
          int64_t* again, int64_t* found) {
    Parts next{0, rows, starts, ends, again};
    const int code = judge_profile({intervals, count, lengths, per_u, per_x, rest, bounds}, *reinterpret_cast<const Splitting*>(rule),
                                   constant, groups, x, may_split, is_first, bends, next);
    *found = next.count;
    return code;
}

int times_between(int64_t intervals, const double* lengths, const double* x, const double* bends, double start, double end,
                  double* times) {
    for (int64_t i = 0; i < intervals; i++) times[i] = time_between(lengths[i], x[i], x[i + 1], bends[i], start, end);
    return OK;
}

// A search for sampled peaks: its handle and the number of samples that it wants go into `state`.
int start_search(int64_t pieces, int64_t columns, int64_t width, int64_t groups, int64_t quantities,
                 const double* accuracy, const int64_t* parts, const int64_t* group, const int64_t* quantity,
                 const double* above, int64_t* state) {
    PeakSearch* search = static_cast<PeakSearch*>(calloc(1, sizeof(PeakSearch)));
    if (!search) return NO_MEMORY;
    state[0] = (int64_t)(intptr_t)search;
    search->pieces = pieces; search->columns = columns; search->width = width;
    search->groups = groups; search->quantities = quantities;
    memcpy(&search->a, accuracy, sizeof(Accuracy));
    if (!search->set(parts, group, quantity, above)) return NO_MEMORY;
    state[1] = search->wanted;
    return OK;
}

int wanted_samples(const int64_t* state, int64_t* pieces, double* units) {
    const PeakSearch* search = reinterpret_cast<const PeakSearch*>((intptr_t)state[0]);
    memcpy(pieces, search->sample_piece, search->wanted * sizeof(int64_t));
    memcpy(units, search->unit, search->wanted * sizeof(double));
    return OK;
}

int take_samples(int64_t* state, const double* values) {
    PeakSearch* search = reinterpret_cast<PeakSearch*>((intptr_t)state[0]);
    const int code = search->take(values);
    state[1] = search->wanted;
    return code;
}

int found_peaks(const int64_t* state, double* best, int64_t* pieces, double* units, int64_t* columns) {
    const PeakSearch* search = reinterpret_cast<const PeakSearch*>((intptr_t)state[0]);
    const int64_t count = search->groups * search->quantities;
    memcpy(best, search->best, count * sizeof(double));
    memcpy(pieces, search->at_piece, count * sizeof(int64_t));
    memcpy(units, search->at_unit, count * sizeof(double));
    memcpy(columns, search->at_column, count * sizeof(int64_t));
    return OK;
}

int end_search(const int64_t* state) {
    PeakSearch* search = reinterpret_cast<PeakSearch*>((intptr_t)state[0]);
    if (search) { search->release(); free(search); }
    return OK;
}

// Bound the peaks of quantities of a motion: what they reach and where goes to `reached`, `piece`, `unit` and `column`, which
// have what is known from elsewhere, and what they nowhere exceed to `bound`, all (quantities).
int bound_peaks(int64_t joints, const double* links, const double* load, int64_t tool_joints, const double* tool,
                const double* axes, int64_t pieces, int64_t order, const double* lengths, const double* coefficients,
                const double* bernstein,
                int64_t columns, int64_t quantities, const int64_t* kind, const int64_t* joint, const int64_t* quantity,
                const double* middle, const double* half, const int64_t* parts_of_piece, const double* paths, const double* wish,
                int64_t curve_pieces, const double* curves, int64_t generators, int64_t chains, const double* weights,
                const double* chain_links, const double* chain_loads, const double* magnitudes, const double* following, double* reached, double* bound, int64_t* piece,
                double* unit, int64_t* column) {
    const ToolChain arm{joints, tool_joints, links, load, tool, axes};
    const Pieces motion{pieces, joints, order, coefficients, lengths};
    const Columns of{columns, quantities, kind, joint, quantity, middle, half};
    const Paths requested{reinterpret_cast<const PartsOfPath*>(parts_of_piece), paths};
    Bounded found{reached, bound, unit, piece, column};
    SpeedLines lines[3];
    for (int64_t k = 0, size = joints * curve_pieces; k < 3; k++, curves += 3 * size)
        lines[k] = {curve_pieces, curves, curves + size, curves + 2 * size};
    const Spread spread{generators, chains, weights, chain_links, chain_loads, reinterpret_cast<const Magnitude*>(magnitudes)};
    const FollowingErrors errors{following, following ? following + joints : nullptr, following ? following + 2 * joints : nullptr};
    BoundSearch search(arm, motion, bernstein, of, requested, *reinterpret_cast<const Wish*>(wish), lines, spread, errors, found);
    if (!search.bodies || !search.states || !search.forces || !search.shifted || !search.added || !search.rates) return NO_MEMORY;
    return search.first();
}

// Bound the integrals (joints) of squared torques over all pieces of a motion.
int torque_squares(int64_t joints, const double* links, const double* load, int64_t pieces, int64_t order,
                   const double* lengths, const double* coefficients, const double* bernstein, const double* tolerance,
                   double most_intervals, double* lower, double* upper) {
    const Pieces motion{pieces, joints, order, coefficients, lengths};
    TorqueSquares squares(joints, links, load, motion, bernstein, tolerance, most_intervals, lower, upper);
    if (!squares.bodies || !squares.states || !squares.forces || !squares.shifted) return NO_MEMORY;
    return squares.run();
}

// Prove that a motion keeps clear, in a scene that is a table of sizes and addresses; `frames` (joints + 1) is filled with
// the frames of the joint position whenever `measure` is called.
int prove_clearance(const int64_t* scene, int64_t pieces, int64_t order, const double* lengths, const double* coefficients,
                    const double* breakpoints, const double* request, int64_t measure, double* frames, double* found) {
    const Scene& in = *reinterpret_cast<const Scene*>(scene);
    const Motion motion{pieces, in.joints, order, lengths, coefficients, breakpoints};
    Proof proof(in, motion, *reinterpret_cast<const Request*>(request), reinterpret_cast<Frame*>(frames),
                reinterpret_cast<Measure>((intptr_t)measure), *reinterpret_cast<Found*>(found));
    return proof.run();
}

// Find the pairs at joint positions whose bounds, less what `reach` (joint positions, joints) may change, are below their margins. The
// number of all is counted, and the first `room` are stored.
int near_pairs(const int64_t* scene, int64_t position_count, const double* positions, const double* reach, double own_margin,
               int64_t room, int64_t* rows, int64_t* pairs, double* bounds, double* motions, int64_t* count) {
    const Scene& in = *reinterpret_cast<const Scene*>(scene);
    Scratch<Frame> frames(in.joints + 1);
    PlacedRobot at(in, frames.data);
    List<Item> items;
    if (!frames || !at) return NO_MEMORY;
    const Wanted wanted{0.0, INFINITY, {-INFINITY, -INFINITY, -INFINITY}};
    *count = 0;
    for (int64_t row = 0; row < position_count; row++) {
        double lower[KINDS] = {};
        items.count = 0;
        at.put(positions + row * in.joints, reach + row * in.joints);
        if (const int code = gather(at, wanted, own_margin, items, lower)) return code;
        for (int64_t i = 0; i < items.count; i++, ++*count) {
            if (*count >= room) continue;
            rows[*count] = row;
            pairs[*count] = items[i].pair;
            bounds[*count] = items[i].near;
            motions[*count] = items[i].motion;
        }
    }
    return OK;
}

// Decide joint positions, on request up to the first that is blocked: those behind it count as free.
int decide_positions(const int64_t* scene, int64_t count, const double* positions, double contact, int64_t stops, int64_t measure,
                     double* frames, int64_t* decisions) {
    const Scene& in = *reinterpret_cast<const Scene*>(scene);
    PlacedRobot at(in, reinterpret_cast<Frame*>(frames));
    List<Item> items;
    Scratch<double> still(in.joints);
    if (!at || !still) return NO_MEMORY;
    for (int64_t j = 0; j < in.joints; j++) still[j] = 0.0;
    const Wanted wanted{contact, INFINITY, {-INFINITY, -INFINITY, -INFINITY}};
    const Measure function = reinterpret_cast<Measure>((intptr_t)measure);
    for (int64_t row = 0; row < count; row++) decisions[row] = FREE;
    for (int64_t row = 0; row < count; row++) {
        at.put(positions + row * in.joints, still.data);
        if (const int code = decide_position(at, wanted, items, function, decisions[row])) return code;
        if (stops && decisions[row] == BLOCKED) break;
    }
    return OK;
}

// Decide the joint positions within excursions of some: 0 all are free, 2 all are blocked (on request), 1 neither is proved.
int decide_blocks(const int64_t* scene, int64_t count, const double* positions, const double* excursions,
                  const int64_t* tries_blocked, int64_t measure, double* frames, int64_t* decisions) {
    const Scene& in = *reinterpret_cast<const Scene*>(scene);
    PlacedRobot at(in, reinterpret_cast<Frame*>(frames));
    List<Item> items;
    if (!at) return NO_MEMORY;
    const Wanted wanted{0.0, INFINITY, {-INFINITY, -INFINITY, -INFINITY}};
    for (int64_t row = 0; row < count; row++) {
        at.put(positions + row * in.joints, excursions + row * in.joints);
        const Measure function = reinterpret_cast<Measure>((intptr_t)measure);
        if (const int code = decide(at, wanted, items, tries_blocked[row] != 0, function, decisions[row])) return code;
    }
    return OK;
}

// Improve the chosen states (tasks) of an order until no step and no choice of states next to the flagged tasks saves time.
int settle_order(int64_t states, int64_t tasks, const double* durations, const int64_t* opposites, const int64_t* task_of,
                 const int64_t* states_of, int64_t rules, const int64_t* before, const int64_t* after, const int64_t* group_of,
                 int64_t lengths, const int64_t* moved, int64_t* chosen, int64_t* flags, double deadline) {
    const OrderProblem in{states, tasks, durations, opposites, task_of, states_of, rules, before, after, group_of, lengths, moved};
    OrderSearch search(in, chosen, flags, deadline);
    if (!search) return NO_MEMORY;
    search.run();
    return OK;
}

int least_joint_distances(int64_t tasks, int64_t joints, const int64_t* states_of, const double* exits, const int64_t* blocks_of,
                          const double* entries, double* least) {
    least_distances(tasks, joints, states_of, exits, blocks_of, entries, least);
    return OK;
}

// The cheapest ways to all states of layers: their total costs, the states before, and the positions turned next to these.
int cheapest_ways(int64_t layers, int64_t joints, const int64_t* first_of, const double* fewest, const double* most, const double* costs,
                  const double* weights, const double* furthest, double* positions, double* totals, int64_t* origins) {
    return cheapest_ways({layers, joints, first_of, fewest, most, costs, weights, furthest}, positions, totals, origins);
}
}
