// Peaks of quantities of a motion, bounded on all of it: intervals are halved until the bound on each is no more than what
// is reached somewhere, or hardly more.
#pragma once
#include "deviations.hpp"
#include "enclosures.hpp"
#include "following_errors.hpp"
#include "polynomials.hpp"
#include "sampled_peaks.hpp"

enum Kind : int64_t {  // KINDS of planner/kernels/bounded_peaks.py
    TORQUE, LINEAR_VELOCITY, ANGULAR_VELOCITY, LINEAR_ACCELERATION, ANGULAR_ACCELERATION, CENTRIPETAL, LINEAR_JERK, ANGULAR_JERK,
    POWER, TOTAL_POWER, TORQUE_AT_SPEED, TORQUE_WITH_TOLERANCES, ACCELERATION_AT_SPEED, JERK_AT_SPEED, PATH_POSITION, PATH_ORIENTATION
};

// Columns: what they are of, and the middle between their limits and the distance of these from there on each piece.
struct Columns { int64_t count, quantities; const int64_t *kind, *joint, *quantity; const double *middle, *half; };
// Limits by speed: from the end of the piece before up to `end`, the limit at a speed is `most` - `slope` speed; each is
// (joints, pieces), and unused pieces begin at an infinite speed.
struct SpeedLines { int64_t pieces; const double *end, *most, *slope; };
// What may be added to torques: each generator, a sum of the torques of chains by weights, times a number from -1 to 1; and a
// remainder, see torque_magnitudes (null: none).
struct Spread { int64_t generators, chains; const double *weights, *links, *loads; const Magnitude* magnitudes; };
// The requested paths of the tool, and which of them a piece follows.
struct Paths { const PartsOfPath* of_piece; const double* paths; };
struct Wish { double known_to, decided_at, least_radius, most_intervals; };  // WISH_NUMBERS of planner/kernels/bounded_peaks.py
// The peaks of each quantity: a share of the limit that is reached and where, and one that is nowhere exceeded.
struct Bounded { double *reached, *bound, *unit; int64_t *piece, *column; };

struct BoundSearch {
    static constexpr double START = 1.0;       // travel of all joints together, rad or m, on half of a first interval
    static constexpr double NARROWEST = 1e-13; // half width of unit time that is halved no more
    static constexpr double FINE = 1e-11;      // relative distance of a bound from what is reached that is left as it is
    static constexpr double NOTHING = 1e-9;    // share of a limit that is left as it is: rounding where nothing is used
    static constexpr double ROUNDING = 8388608.0 * UNIT;  // of distances from paths, by the size of the arm, and of angles
    static constexpr double OUTWARD = 1.0 + 8.0 * UNIT;
    struct Interval { int64_t piece; double middle, half; };
    const ToolChain& arm;
    const Pieces& motion;
    const double* bernstein;
    const Columns& columns;
    const Paths& paths;
    const Wish& wish;
    const SpeedLines* curves;
    const Spread& spread;
    const FollowingErrors& following;
    Bounded& found;
    Hulls hulls;
    ToolMotion tool;
    Scratch<TurnedBody> bodies;
    Scratch<Taylor> states, forces, added;  // added: (1 + generators, joints), the first for one chain
    Scratch<V> shifted;
    Scratch<double> rates;  // (7, joints): magnitudes of velocity, acceleration and jerk, and room for four more rows
    Interval *now = nullptr, *next = nullptr;
    double* open = nullptr;  // bounds (intervals, quantities) of now that could still be lowered
    Deviations deviations;
    bool needs_torques = false, needs_spread = false, needs_paths = false;
    int orders = 0, count = 1;

    BoundSearch(const ToolChain& arm, const Pieces& motion, const double* bernstein, const Columns& columns, const Paths& paths,
                const Wish& wish, const SpeedLines* curves, const Spread& spread, const FollowingErrors& following, Bounded& found)
        : arm(arm), motion(motion), bernstein(bernstein), columns(columns), paths(paths), wish(wish), curves(curves), spread(spread), following(following), found(found),
          bodies(arm.joints), states(4 * arm.joints), forces(arm.joints), added((1 + spread.generators) * arm.joints), shifted(2 * motion.order), rates(7 * arm.joints) {
        for (int64_t c = 0; c < columns.count; c++)
            switch (columns.kind[c]) {
                case TORQUE_WITH_TOLERANCES: needs_spread = true; [[fallthrough]];
                case TORQUE: case POWER: case TOTAL_POWER: case TORQUE_AT_SPEED: needs_torques = true; break;
                case PATH_POSITION: case PATH_ORIENTATION: needs_paths = true; break;
                case LINEAR_VELOCITY: case ANGULAR_VELOCITY: orders = orders > 1 ? orders : 1; break;
                case ACCELERATION_AT_SPEED: count = count > 3 ? count : 3; break;
                case JERK_AT_SPEED: count = 4; break;
                case LINEAR_JERK: case ANGULAR_JERK: orders = 3; break;
                default: orders = orders > 2 ? orders : 2;
            }
        const int needed = needs_torques && orders < 2 ? 3 : orders + 1;
        count = needed > count ? needed : count;
    }
    ~BoundSearch() { free(now); free(next); free(open); }

    double enough(int64_t quantity) const {
        const double most = found.reached[quantity], more = fmax(most * (1.0 + wish.known_to), NOTHING);
        return most <= wish.decided_at && more > wish.decided_at ? wish.decided_at : more;
    }
    void reach(int64_t quantity, double share, int64_t piece, double unit, int64_t column) {
        if (!(share > found.reached[quantity])) return;
        found.reached[quantity] = share; found.piece[quantity] = piece;
        found.unit[quantity] = unit; found.column[quantity] = column;
    }

    int first() {
        int64_t total = 0;
        for (int pass = 0; pass < 2; pass++) {
            int64_t n = 0;
            for (int64_t p = 0; p < motion.pieces; p++) {
                double travel = 0.0;
                for (int64_t j = 0; j < motion.joints; j++) {
                    const double* b = bernstein + (p * motion.joints + j) * motion.order;
                    double steepest = 0.0;
                    for (int64_t k = 1; k < motion.order; k++) steepest = fmax(steepest, fabs(b[k] - b[k - 1]));
                    travel += steepest * (double)(motion.order - 1);
                }
                const double wanted = ceil(fmax(travel / (2.0 * START), 1.0));
                if (!(wanted + (double)n <= wish.most_intervals)) return TOO_MANY;
                const int64_t parts = (int64_t)wanted;
                for (int64_t k = 0; k < parts; k++, n++)
                    if (pass) now[n] = {p, ((double)k + 0.5) / wanted, 0.5 / wanted};
            }
            total = n;
            if (!pass && !PeakSearch::grow(now, n)) return NO_MEMORY;
        }
        return run(total);
    }
    int run(int64_t n) {
        double spent = 0.0;
        while (n > 0) {
            if (!PeakSearch::grow(open, n * columns.quantities)) return NO_MEMORY;
            for (int64_t i = 0; i < n; i += W) evaluate(now + i, n - i < W ? n - i : W, open + i * columns.quantities);
            spent += (double)n;
            int64_t left = 0;
            for (int64_t i = 0; i < n; i++) {
                const double* bound = open + i * columns.quantities;
                bool is_open = false;
                for (int64_t k = 0; k < columns.quantities; k++) is_open |= !(bound[k] <= enough(k));
                if (is_open && now[i].half > NARROWEST) { now[left++] = now[i]; continue; }
                for (int64_t k = 0; k < columns.quantities; k++) found.bound[k] = fmax(found.bound[k], bound[k]);
            }
            if (spent + 2.0 * (double)left > wish.most_intervals) return TOO_MANY;
            if (!PeakSearch::grow(next, 2 * left)) return NO_MEMORY;
            for (int64_t i = 0; i < left; i++) {
                const Interval at = now[i];
                const double half = 0.5 * at.half;
                next[2 * i] = {at.piece, at.middle - half, half};
                next[2 * i + 1] = {at.piece, at.middle + half, half};
            }
            Interval* other = now;
            now = next;
            next = other;
            n = 2 * left;
        }
        for (int64_t k = 0; k < columns.quantities; k++) found.bound[k] = fmax(found.bound[k], found.reached[k]);
        return OK;
    }

    void evaluate(const Interval* intervals, int64_t used, double* bounds) {
        Lanes at;
        for (int l = 0; l < W; l++) {
            const Interval& own = intervals[l < used ? l : used - 1];
            at.piece[l] = own.piece;
            at.middle[l] = own.middle;
            // Rounded outward, so that intervals meet.
            at.half[l] = own.half * (1.0 + 4.0 * UNIT) + 2.0 * UNIT;
        }
        const int64_t joints = arm.joints;
        for (int64_t j = 0; j < joints; j++) {
            Taylor of[4];
            states_of(motion, at, j, count, shifted.data, of);
            for (int d = 0; d < count; d++) states[d * joints + j] = of[d];
            TurnedBody& body = bodies[j];
            body.link = reinterpret_cast<const Link*>(arm.links) + j;
            body.q = of[0];
            sine_cosine(of[0], body.s, body.c);
        }
        if (needs_torques)
            torques<true, true, true>(joints, reinterpret_cast<const Link*>(arm.links), *reinterpret_cast<const Load*>(arm.load), bodies.data,
                                      states.data + joints, states.data + 2 * joints, forces.data);
        if (needs_spread) find_spread();
        if (orders) move_tool(arm.tool_joints, bodies.data, states.data, joints, orders, arm.tool, tool);
        if (needs_paths) {
            PartsOfPath own[W];
            for (int l = 0; l < W; l++) own[l] = paths.of_piece[at.piece[l]];
            deviations.find(arm, bodies.data, reinterpret_cast<const ToolPath*>(paths.paths), own, hulls);
        }
        for (int64_t i = 0; i < used * columns.quantities; i++) bounds[i] = 0.0;
        for (int64_t c = 0; c < columns.count; c++) {
            const int64_t kind = columns.kind[c];
            if (kind == CENTRIPETAL) { bound_bends(c, intervals, used, bounds); continue; }
            if (kind == TORQUE_WITH_TOLERANCES) { bound_with_spread(c, intervals, used, bounds); continue; }
            if (kind == TORQUE_AT_SPEED || kind == ACCELERATION_AT_SPEED || kind == JERK_AT_SPEED) { bound_by_speed(c, intervals, used, bounds); continue; }
            if (kind == PATH_POSITION || kind == PATH_ORIENTATION) { bound_deviation(c, intervals, used, bounds); continue; }
            const bool is_signed = kind == TORQUE || kind >= POWER;
            const Taylor value = is_signed ? of_joints(kind, columns.joint[c]) : square(*of_tool(kind));
            for (int64_t l = 0; l < used; l++) {
                const int64_t piece = intervals[l].piece, k = columns.quantity[c];
                const double half = columns.half[piece * columns.count + c], middle = columns.middle[piece * columns.count + c];
                if (!(half < INFINITY)) continue;
                double terms[TERMS];
                for (int e = 0; e < TERMS; e++) terms[e] = value.c[e][l];
                double rest = value.rest[l] * OF_SUMS + Hulls::rounding(terms);
                if (is_signed) { terms[0] -= middle; rest += UNIT * (fabs(middle) + fabs(terms[0])); }
                const double away = is_signed ? 0.0 : off_plan(kind, l), need = enough(k) * half - away;
                const Hulls::Range range = hulls.largest(terms, is_signed ? need - rest : fmax(need, 0.0) * need - rest, true);
                const double most = range.most + rest, least = fmax(range.seen - rest, 0.0);
                close(c, intervals[l], range.x, (is_signed ? least : sqrt(least) + off_plan(kind, l, range.x)) / half,
                      (is_signed ? most : sqrt(most) + away) / half, bounds[l * columns.quantities + k]);
            }
        }
    }
    // Magnitudes of the derivatives 1 to `orders` of the joints: on all of the interval of a lane, or at least those at x.
    void find_rates(int orders, int64_t l) {
        for (int64_t k = 0; k < orders * arm.joints; k++) {
            const Taylor& of = states[arm.joints + k];
            rates[k] = (of.size[l] + of.rest[l]) * OF_SUMS;
        }
    }
    void find_rates(int orders, int64_t l, double x) {
        for (int64_t k = 0; k < orders * arm.joints; k++) {
            const Taylor& of = states[arm.joints + k];
            double terms[TERMS];
            for (int e = 0; e < TERMS; e++) terms[e] = of.c[e][l];
            rates[k] = fmax(fabs(horner(terms, TERMS, x)) - of.rest[l] * OF_SUMS - Hulls::rounding(terms), 0.0);
        }
    }
    // By how much a quantity of the tool may differ by following errors, on all of an interval, or at least at x.
    template <class... X> double off_plan(int64_t kind, int64_t l, X... x) {
        if (!following.errors || kind < LINEAR_VELOCITY || kind > ANGULAR_JERK) return 0.0;
        const int order = kind <= ANGULAR_VELOCITY ? 1 : kind <= ANGULAR_ACCELERATION ? 2 : 3;
        const bool is_angular = kind == ANGULAR_VELOCITY || kind == ANGULAR_ACCELERATION || kind == ANGULAR_JERK;
        find_rates(order, l, x...);
        return tool_difference(following, arm.tool_joints, order, is_angular, rates.data, arm.joints) * (sizeof...(X) ? 1.0 : OF_SUMS);
    }
    // The remainder of the generators of a torque, likewise.
    template <class... X> double remainder(int64_t joint, int64_t l, X... x) {
        if (!spread.magnitudes) return 0.0;
        double *most = rates.data, *scratch = most + 3 * arm.joints, *of = scratch + 2 * arm.joints;
        find_rates(2, l, x...);
        torque_magnitudes(arm.joints, spread.magnitudes, most, most + arm.joints, scratch, of);
        return of[joint] * (sizeof...(X) ? 1.0 : OF_SUMS);
    }
    const Vector<Taylor>* of_tool(int64_t kind) const {
        const Vector<Taylor>* all[] = {nullptr, tool.v, tool.w, tool.v + 1, tool.w + 1, nullptr, tool.v + 2, tool.w + 2};
        return all[kind];
    }
    // The torque or the mechanical power of a joint, or the power of all joints.
    Taylor of_joints(int64_t kind, int64_t joint) {
        const Taylor* rates = states.data + arm.joints;
        if (kind == TORQUE) return forces[joint];
        if (kind == POWER) return forces[joint] * rates[joint];
        Taylor sum = forces[0] * rates[0];
        for (int64_t j = 1; j < arm.joints; j++) sum = sum + forces[j] * rates[j];
        return sum;
    }
    // Take what a column reaches in an interval, and its bound there.
    void close(int64_t column, const Interval& at, double x, double reached, double bound, double& open) {
        const int64_t k = columns.quantity[column];
        bound = isnan(bound) ? (double)INFINITY : bound * OUTWARD;
        reach(k, reached / OUTWARD, at.piece, fmin(fmax(at.middle + x * at.half, 0.0), 1.0), column);
        if (bound <= reached * (1.0 + FINE)) found.bound[k] = fmax(found.bound[k], bound);
        else open = fmax(open, bound);
    }

    // The acceleration across the path, |v x a| / |v|, but no more than |v|^2 by the least radius, nor than |a|.
    void bound_bends(int64_t c, const Interval* intervals, int64_t used, double* bounds) {
        const Taylor across = square(cross(tool.v[0], tool.v[1])), speed = square(tool.v[0]), gain = square(tool.v[1]);
        for (int64_t l = 0; l < used; l++) {
            const int64_t piece = intervals[l].piece, k = columns.quantity[c];
            const double half = columns.half[piece * columns.count + c], radius = wish.least_radius;
            if (!(half < INFINITY)) continue;
            double N[TERMS], S[TERMS], A[TERMS];
            for (int e = 0; e < TERMS; e++) { N[e] = across.c[e][l]; S[e] = speed.c[e][l]; A[e] = gain.c[e][l]; }
            const double of_n = across.rest[l] * OF_SUMS + Hulls::rounding(N), of_s = speed.rest[l] * OF_SUMS + Hulls::rounding(S);
            const double of_a = gain.rest[l] * OF_SUMS + Hulls::rounding(A);
            double highest = 0.0, reached = 0.0, at = 0.0;
            for (double x = -1.0; x <= 1.0; x += 1.0) {
                const double n = horner(N, TERMS, x), s = horner(S, TERMS, x);
                if (s > of_s) highest = fmax(highest, n / s);
                const double bend = fmin(sqrt(fmax(n - of_n, 0.0) / (s + of_s)), fmax(s - of_s, 0.0) / radius);
                if (bend > reached) { reached = bend; at = x; }
            }
            double G[TERMS];
            for (int e = 0; e < TERMS; e++) G[e] = N[e] - highest * S[e];
            const double rest = of_n + highest * of_s + 4.0 * Hulls::rounding(N) + 4.0 * highest * Hulls::rounding(S);
            const double above = hulls.largest(G, -INFINITY, false).most + rest, slowest = hulls.least(S) - of_s;
            double bound = slowest > 0.0 && !isnan(above) ? highest + fmax(above, 0.0) / slowest : (double)INFINITY;
            bound = sqrt(fmin(bound, hulls.largest(A, 0.0, true).most + of_a));
            bound = fmin(bound, (hulls.largest(S, 0.0, true).most + of_s) / radius);
            close(c, intervals[l], at, reached / half, bound / half, bounds[l * columns.quantities + k]);
        }
    }

    // A torque, acceleration or jerk by its limit at the speed: with m the share at a sample, |torque| - m (limit on the line of a
    // piece) by the least limit on that piece bounds the excess over m, for all pieces whose speeds the joint has in the interval.
    void bound_by_speed(int64_t c, const Interval* intervals, int64_t used, double* bounds) {
        const int64_t joint = columns.joint[c], kind = columns.kind[c], joints = arm.joints;
        const SpeedLines& lines = curves[kind == TORQUE_AT_SPEED ? 0 : kind == ACCELERATION_AT_SPEED ? 1 : 2];
        const int64_t first = joint * lines.pieces;
        const Taylor &torque = kind == TORQUE_AT_SPEED ? forces[joint] : states[(kind == ACCELERATION_AT_SPEED ? 2 : 3) * joints + joint];
        const Taylor& rate = states[joints + joint];
        for (int64_t l = 0; l < used; l++) {
            const double half = columns.half[intervals[l].piece * columns.count + c];
            if (!(half < INFINITY) || !(lines.most[first] < INFINITY)) continue;
            double T[TERMS], R[TERMS], G[TERMS];
            for (int e = 0; e < TERMS; e++) { T[e] = torque.c[e][l]; R[e] = rate.c[e][l]; }
            const double of_t = torque.rest[l] * OF_SUMS + Hulls::rounding(T), of_r = rate.rest[l] * OF_SUMS + Hulls::rounding(R);
            const double most = hulls.largest(R, -INFINITY, false).most + of_r, least = hulls.least(R) - of_r;
            const double fastest = fmax(most, -least), slowest = fmax(0.0, fmax(least, -most));
            double highest = 0.0, reached = 0.0, at = 0.0;
            for (double x = -1.0; x <= 1.0; x += 1.0) {
                const double size = fabs(horner(T, TERMS, x)), speed = fabs(horner(R, TERMS, x));
                highest = fmax(highest, size / limit_at(lines, first, speed));
                const double share = fmax(size - of_t, 0.0) / limit_at(lines, first, fmax(speed - of_r, 0.0)) / OUTWARD;
                if (share > reached) { reached = share; at = x; }
            }
            double bound = highest, begin = 0.0;
            for (int64_t k = 0; k < lines.pieces; begin = lines.end[first + k], k++) {
                if (!(begin <= fastest) || lines.end[first + k] < slowest) continue;
                const double slope = lines.slope[first + k], line = lines.most[first + k];
                const double floor = line - slope * fmin(fastest, lines.end[first + k]);
                for (int sides = 0; sides < 4; sides++) {
                    const double way = sides & 1 ? 1.0 : -1.0, of_torque = sides & 2 ? 1.0 : -1.0;
                    if (way > 0.0 ? !(most > 0.0) && least < 0.0 : !(least < 0.0)) continue;
                    for (int e = 0; e < TERMS; e++) G[e] = of_torque * T[e] + highest * slope * way * R[e];
                    G[0] -= highest * line;
                    const double rest = of_t + highest * slope * of_r + Hulls::rounding(T) +
                                        highest * (slope * Hulls::rounding(R) + 512.0 * UNIT * line);
                    const double above = hulls.largest(G, -INFINITY, false).most + rest;
                    const double own = isnan(above) ? (double)INFINITY : highest + fmax(above, 0.0) / (floor * (1.0 - 512.0 * UNIT));
                    bound = fmax(bound, floor > 0.0 ? own : (double)INFINITY);
                }
            }
            close(c, intervals[l], at, reached / half, bound / half, bounds[l * columns.quantities + columns.quantity[c]]);
        }
    }
    // The generators of what may be added to the torques.
    void find_spread() {
        const int64_t joints = arm.joints;
        for (int64_t i = joints; i < (1 + spread.generators) * joints; i++) added[i] = Taylor{};
        for (int64_t n = 0; n < spread.chains; n++) {
            const Link* links = reinterpret_cast<const Link*>(spread.links) + n * joints;
            for (int64_t j = 0; j < joints; j++) bodies[j].link = links + j;
            torques<true, true, true>(joints, links, reinterpret_cast<const Load*>(spread.loads)[n], bodies.data,
                                      states.data + joints, states.data + 2 * joints, added.data);
            for (int64_t g = 0; g < spread.generators; g++) {
                const double weight = spread.weights[g * spread.chains + n];
                if (weight == 0.0) continue;
                Taylor* to = added.data + (1 + g) * joints;
                for (int64_t j = 0; j < joints; j++) to[j] = to[j] + scaled(weight, added[j]);
            }
        }
        for (int64_t j = 0; j < joints; j++) bodies[j].link = reinterpret_cast<const Link*>(arm.links) + j;
    }
    // The torque and the magnitudes of all generators: a generator of one sign is added with it, another one by its largest
    // magnitude.
    void bound_with_spread(int64_t c, const Interval* intervals, int64_t used, double* bounds) {
        const int64_t joint = columns.joint[c];
        for (int64_t l = 0; l < used; l++) {
            const double half = columns.half[intervals[l].piece * columns.count + c];
            if (!(half < INFINITY)) continue;
            double T[TERMS], S[TERMS] = {}, G[TERMS], sizes = 0.0;
            for (int e = 0; e < TERMS; e++) T[e] = forces[joint].c[e][l];
            double at_samples[3] = {}, rest = forces[joint].rest[l] * OF_SUMS + Hulls::rounding(T), within = 0.0;
            for (int64_t g = 1; g <= spread.generators; g++) {
                const Taylor& own = added[g * arm.joints + joint];
                for (int e = 0; e < TERMS; e++) { G[e] = own.c[e][l]; sizes += fabs(G[e]); }
                const double off = own.rest[l] * OF_SUMS + Hulls::rounding(G);
                for (int n = 0; n < 3; n++) at_samples[n] += fabs(horner(G, TERMS, n - 1.0));
                const double most = hulls.largest(G, -INFINITY, false).most, least = hulls.least(G);
                rest += off;
                if (least >= 0.0 || most <= 0.0) for (int e = 0; e < TERMS; e++) S[e] += most > 0.0 ? G[e] : -G[e];
                else within += isnan(most + least) ? (double)INFINITY : fmax(most, -least);
            }
            for (int n = 0; n < 3; n++) at_samples[n] += remainder(joint, l, n - 1.0);
            within += remainder(joint, l);
            for (int e = 0; e < TERMS; e++) sizes += fabs(T[e]);
            rest += (double)(spread.generators + TERMS) * 64.0 * UNIT * sizes;
            double bound = 0.0, reached = 0.0, at = 0.0;
            for (double way = -1.0; way <= 1.0; way += 2.0) {
                for (int e = 0; e < TERMS; e++) G[e] = S[e] + way * T[e];
                const double most = hulls.largest(G, -INFINITY, false).most;
                bound = fmax(bound, isnan(most + rest) ? (double)INFINITY : most + within + rest);
            }
            for (int n = 0; n < 3; n++) {
                const double share = fabs(horner(T, TERMS, n - 1.0)) + at_samples[n] - rest;
                if (share > reached) { reached = share; at = n - 1.0; }
            }
            close(c, intervals[l], at, reached / half, bound / half, bounds[l * columns.quantities + columns.quantity[c]]);
        }
    }
    double limit_at(const SpeedLines& lines, int64_t first, double speed) const {
        int64_t k = first;
        while (k + 1 < first + lines.pieces && speed > lines.end[k]) k++;
        return lines.most[k] - lines.slope[k] * speed;
    }

    // The distance from a path, or the angle, unless the tool is all the time where it may leave the path.
    void bound_deviation(int64_t c, const Interval* intervals, int64_t used, double* bounds) {
        const Deviations& of = deviations;
        const bool is_angle = columns.kind[c] == PATH_ORIENTATION;
        for (int64_t l = 0; l < used; l++) {
            const int64_t piece = intervals[l].piece;
            const double half = columns.half[piece * columns.count + c];
            if (!(half < INFINITY) || of.is_left[l]) continue;
            auto most = [&](const Taylor& t, bool magnitudes) {
                double terms[TERMS];
                for (int e = 0; e < TERMS; e++) terms[e] = t.c[e][l];
                const double rest = t.rest[l] * OF_SUMS + Hulls::rounding(terms), found = hulls.largest(terms, -INFINITY, magnitudes).most;
                return isnan(found + rest) ? (double)INFINITY : found + rest;
            };
            double bound;
            if (is_angle) {
                const double sine = sqrt(fmax(most(of.sine, false), 0.0)), chord = 0.5 * (1.0 + most(number<Taylor>(0.0) - of.cosine, false));
                bound = 2.0 * asin(sqrt(fmin(fmax(chord, 0.0), 1.0)));  // (1 - cos) / 2 is the square of the sine of the half
                if (chord < 0.5) bound = fmin(bound, asin(fmin(sine, 1.0)));
            } else bound = sqrt(fmax(most(of.distance, false), 0.0));
            int best = 0;
            for (int n = 1; n < 3; n++)
                if (of.reached[l][n][is_angle] > of.reached[l][best][is_angle]) best = n;
            const double reached = fmax(of.reached[l][best][is_angle], 0.0), least = is_angle ? 1.0 : of.position.x.size[l] +
                of.position.y.size[l] + of.position.z.size[l];
            // Rounding is left as it is.
            close(c, intervals[l], best - 1.0, (bound <= ROUNDING * least ? bound : reached) / half, bound / half,
                  bounds[l * columns.quantities + columns.quantity[c]]);
        }
    }
};
