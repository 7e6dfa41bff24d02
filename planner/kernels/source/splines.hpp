// Interpolating splines in time of degree 2 K + 1, which are C2K but where a velocity is given: their coefficients, their
// peaks beside limits, and how these change with the durations.
#pragma once
#include "polynomials.hpp"

// Rows of the tables of a spline of degree 2 K + 1. The ends of a segment are its travel, then derivatives 1 to K by unit
// time at its start, then at its end.
template <int64_t K> struct Hermite {
    static constexpr int64_t DEGREE = 2 * K + 1, ORDER = 2 * K + 2;
    // From the ends to the powers of unit time, but the lowest, which is the position.
    static constexpr double of_cubic[3][3] = {{0, 1, 0}, {3, -2, -1}, {-2, 1, 1}};
    static constexpr double of_quintic[5][5] = {
        {0, 1, 0, 0, 0}, {0, 0, 0.5, 0, 0}, {10, -6, -1.5, -4, 0.5}, {-15, 8, 1.5, 7, -1}, {6, -3, -0.5, -3, 0.5}};

    static double power(int64_t exponent, int64_t end) {
        if constexpr (K == 1) return of_cubic[exponent - 1][end];
        else return of_quintic[exponent - 1][end];
    }

    // The order of differentiation of an end.
    static int64_t order(int64_t end) { return end == 0 ? 0 : (end - 1) % K + 1; }

    // The derivative of some order at unit time u by one of the ends.
    static double derivative(int64_t order, int64_t end, double u) {
        double sum = 0.0;
        for (int64_t e = DEGREE; e >= 1 && e >= order; e--) {
            double factor = power(e, end);
            for (int64_t f = 0; f < order; f++) factor *= (double)(e - f);
            sum = sum * u + factor;
        }
        return order == 0 ? sum * u : sum;
    }
};

static inline double raised(double x, int64_t power) {
    double result = 1.0;
    for (; power > 0; power--) result *= x;
    return result;
}

// The system for derivatives 1 to K at the inner waypoints, by time in units of the shorter segment beside each, that make
// derivatives K + 1 to 2 K continuous: block tridiagonal, and factorised as (L, 1) (D, U). Its rows are those of a
// positive definite matrix in another order, so that blocks need no pivots.
template <int64_t K> struct SplineSystem {
    typedef Hermite<K> H;
    int64_t inner;
    const double* h;
    const int64_t* given;
    double at[2][K][H::DEGREE];  // derivatives K + 1 to 2 K at the start and at the end, by the ends
    Scratch<double> scales, lower, inverse, upper;

    SplineSystem(int64_t segments, const double* h, const int64_t* given)
        : inner(segments - 1), h(h), given(given), scales(segments), lower(segments * K * K), inverse(segments * K * K),
          upper(segments * K * K) {
        for (int64_t r = 0; r < K; r++)
            for (int64_t e = 0; e < H::DEGREE; e++)
                for (int end = 0; end < 2; end++) at[end][r][e] = H::derivative(K + 1 + r, e, (double)end);
    }
    explicit operator bool() const { return scales && lower && inverse && upper; }

    // Add one of the blocks of a waypoint's rows: jumps by the derivatives at one end of the segment before or after it.
    void add(double sign, int end, int64_t first, double h, double row_scale, double column_scale, double* block) const {
        for (int64_t r = 0; r < K; r++)
            for (int64_t c = 0; c < K; c++)
                block[r * K + c] +=
                    sign * at[end][r][first + c] * raised(row_scale / h, K + 1 + r) * raised(h / column_scale, c + 1);
    }

    void factorise() {
        for (int64_t w = 0; w < inner; w++) scales[w] = fmin(h[w], h[w + 1]);
        for (int64_t w = 0; w < inner; w++) {
            double *l = lower.data + w * K * K, *d = inverse.data + w * K * K, *u = upper.data + w * K * K, below[K * K];
            for (int64_t i = 0; i < K * K; i++) l[i] = d[i] = u[i] = below[i] = 0.0;
            if (given[w]) {
                for (int64_t i = 0; i < K; i++) d[i * K + i] = 1.0;
                continue;
            }
            add(1.0, 1, 1 + K, h[w], scales[w], scales[w], d);
            add(-1.0, 0, 1, h[w + 1], scales[w], scales[w], d);
            if (w + 1 < inner) add(-1.0, 0, 1 + K, h[w + 1], scales[w], scales[w + 1], u);
            if (w > 0) {
                add(1.0, 1, 1, h[w], scales[w], scales[w - 1], below);
                const double *before = inverse.data + (w - 1) * K * K, *above = upper.data + (w - 1) * K * K;
                for (int64_t r = 0; r < K; r++)
                    for (int64_t c = 0; c < K; c++)
                        for (int64_t i = 0; i < K; i++) l[r * K + c] += below[r * K + i] * before[i * K + c];
                for (int64_t r = 0; r < K; r++)
                    for (int64_t c = 0; c < K; c++)
                        for (int64_t i = 0; i < K; i++) d[r * K + c] -= l[r * K + i] * above[i * K + c];
            }
            if constexpr (K == 1) d[0] = 1.0 / d[0];
            else {
                const double a = d[0], b = d[1], e = d[2], f = d[3], determinant = a * f - b * e;
                d[0] = f / determinant; d[1] = -b / determinant; d[2] = -e / determinant; d[3] = a / determinant;
            }
        }
    }

    // Replace right sides (inner, K, count) by the solution.
    void solve(double* x, int64_t count) const {
        for (int64_t w = 1; w < inner; w++)
            for (int64_t r = 0; r < K; r++)
                for (int64_t i = 0; i < K; i++)
                    for (int64_t c = 0; c < count; c++)
                        x[(w * K + r) * count + c] -= lower.data[(w * K + r) * K + i] * x[((w - 1) * K + i) * count + c];
        for (int64_t w = inner - 1; w >= 0; w--)
            for (int64_t c = 0; c < count; c++) {
                double left[K];
                for (int64_t r = 0; r < K; r++) {
                    left[r] = x[(w * K + r) * count + c];
                    for (int64_t i = 0; w + 1 < inner && i < K; i++)
                        left[r] -= upper.data[(w * K + r) * K + i] * x[((w + 1) * K + i) * count + c];
                }
                for (int64_t r = 0; r < K; r++) {
                    double sum = 0.0;
                    for (int64_t i = 0; i < K; i++) sum += inverse.data[(w * K + r) * K + i] * left[i];
                    x[(w * K + r) * count + c] = sum;
                }
            }
    }

    // Solve the transposed system for a right side (inner, K) that is 0 but at waypoints from `first` on, up to `last`;
    // the solution is cut off beyond.
    void solve_transposed(double* x, int64_t from, int64_t first, int64_t last) const {
        for (int64_t w = first; w <= last; w++) {
            double left[K];
            for (int64_t r = 0; r < K; r++) {
                left[r] = x[w * K + r];
                for (int64_t i = 0; w > first && i < K; i++) left[r] -= upper.data[((w - 1) * K + i) * K + r] * x[(w - 1) * K + i];
            }
            for (int64_t r = 0; r < K; r++) {
                double sum = 0.0;
                for (int64_t i = 0; i < K; i++) sum += inverse.data[(w * K + i) * K + r] * left[i];
                x[w * K + r] = sum;
            }
        }
        for (int64_t w = last - 1; w >= from; w--)
            for (int64_t r = 0; r < K; r++)
                for (int64_t i = 0; i < K; i++) x[w * K + r] -= lower.data[((w + 1) * K + i) * K + r] * x[(w + 1) * K + i];
    }
};

// The spline through positions (segments + 1, joints), at rest at both ends: its coefficients (segments, joints, ORDER) on
// unit time, and the ends (segments, joints, DEGREE). `velocities` (segments - 1, joints) count where they are given.
template <int64_t K>
static inline int interpolate(int64_t segments, int64_t joints, const double* positions, const double* h,
                              const double* velocities, const int64_t* given, double* unit, double* ends) {
    typedef Hermite<K> H;
    SplineSystem<K> system(segments, h, given);
    Scratch<double> unknowns(segments * K * joints);
    if (!system || !unknowns) return NO_MEMORY;
    system.factorise();
    for (int64_t w = 0; w < system.inner; w++)
        for (int64_t r = 0; r < K; r++) {
            const double scale = system.scales[w];
            const double before = system.at[1][r][0] * raised(scale / h[w], K + 1 + r);
            const double after = system.at[0][r][0] * raised(scale / h[w + 1], K + 1 + r);
            for (int64_t j = 0; j < joints; j++) {
                const double* p = positions + w * joints + j;
                unknowns[(w * K + r) * joints + j] =
                    given[w] ? (r ? 0.0 : velocities[w * joints + j] * scale)
                             : after * (p[2 * joints] - p[joints]) - before * (p[joints] - p[0]);
            }
        }
    system.solve(unknowns.data, joints);
    for (int64_t s = 0; s < segments; s++)
        for (int64_t j = 0; j < joints; j++, unit += H::ORDER, ends += H::DEGREE) {
            ends[0] = positions[(s + 1) * joints + j] - positions[s * joints + j];
            for (int64_t k = 0; k < K; k++)
                for (int64_t end = 0; end < 2; end++) {
                    const int64_t w = s - 1 + end;
                    const bool is_inner = w >= 0 && w < system.inner;
                    ends[1 + end * K + k] =
                        is_inner ? unknowns[(w * K + k) * joints + j] / raised(system.scales[w], k + 1) * raised(h[s], k + 1) : 0.0;
                }
            unit[0] = positions[s * joints + j];
            for (int64_t e = 1; e < H::ORDER; e++) {
                unit[e] = 0.0;
                for (int64_t i = 0; i < H::DEGREE; i++) unit[e] += H::power(e, i) * ends[i];
            }
        }
    return OK;
}

// Slopes (points, segments), which are 0 before, of derivatives by time at fixed unit times by the logarithm of each duration.
template <int64_t K>
static inline int spline_slopes(int64_t segments, int64_t joints, const double* h, const int64_t* given, const double* ends,
                                int64_t points, const int64_t* segment, const int64_t* joint, const int64_t* order,
                                const double* u, double* slopes) {
    typedef Hermite<K> H;
    constexpr int64_t REACH = 80;  // segments away from which nothing is felt: a spline forgets as fast as 0.43^segments
    SplineSystem<K> system(segments, h, given);
    Scratch<double> pulls(segments * K);
    if (!system || !pulls) return NO_MEMORY;
    system.factorise();
    const int64_t inner = system.inner;
    for (int64_t p = 0; p < points; p++, slopes += segments) {
        const int64_t s = segment[p], j = joint[p], d = order[p];
        const double* own = ends + (s * joints + j) * H::DEGREE;
        double weights[H::DEGREE];
        for (int64_t e = 0; e < H::DEGREE; e++) {
            weights[e] = H::derivative(d, e, u[p]) / raised(h[s], d);
            slopes[s] += weights[e] * own[e] * (double)(H::order(e) - d);
        }
        const int64_t from = s > REACH ? s - REACH : 0, last = s + REACH < inner ? s + REACH : inner - 1;
        if (inner == 0) continue;
        memset(pulls.data + from * K, 0, (last + 1 - from) * K * sizeof(double));
        for (int64_t end = 0; end < 2; end++) {
            const int64_t w = s - 1 + end;
            for (int64_t k = 0; w >= 0 && w < inner && k < K; k++)
                pulls[w * K + k] = weights[1 + end * K + k] * raised(h[s] / system.scales[w], k + 1);
        }
        system.solve_transposed(pulls.data, from, s > 0 ? s - 1 : 0, last);
        for (int64_t w = from; w <= last; w++)
            for (int64_t r = 0; !given[w] && r < K; r++)
                for (int64_t end = 0; end < 2; end++) {  // the segment after the waypoint starts there, the one before ends
                    const int64_t i = w + 1 - end;
                    const double* of = ends + (i * joints + j) * H::DEGREE;
                    double jump = 0.0;
                    for (int64_t e = 0; e < H::DEGREE; e++)
                        jump += of[e] * (double)(H::order(e) - (K + 1 + r)) * system.at[end][r][e];
                    jump *= raised(system.scales[w] / h[i], K + 1 + r) * pulls[w * K + r];
                    slopes[i] += end ? -jump : jump;
                }
    }
    return OK;
}

// Limits of a spline. Rates are the derivatives whose limits it keeps, from the velocity on.
struct SplineLimits {
    int64_t rates;
    const double *lower, *upper, *position;  // (rates, segments, joints) twice, and (2, joints)
    double near, near_position, at_waypoint, root_tolerance;
    int64_t most_root_steps;
};

// Peaks of a spline, each (peaks): where rates and positions may come nearest to their limits.
struct SplinePeaks {
    int64_t count, *segment, *joint, *order;
    double *u, *value, *excess, *weight;
};

// The root of a polynomial between two places where its signs differ: Newton's method kept inside. If they do not: 0.
static inline double root_between(const double* f, const double* slope, int64_t order, double low, double high,
                                  const SplineLimits& limits) {
    const double at_low = horner(f, order, low), at_high = horner(f, order, high);
    if (!(at_low * at_high < 0.0)) return 0.0;
    double x = low - at_low * (high - low) / (at_high - at_low);
    for (int64_t k = 0; k < limits.most_root_steps; k++) {
        const double value = horner(f, order, x);
        if ((value < 0.0) == (at_low < 0.0)) low = x; else high = x;
        const double newton = x - value / horner(slope, order, x), last = x;
        x = newton >= low && newton <= high ? newton : 0.5 * (low + high);
        if (fabs(x - last) < limits.root_tolerance) break;
    }
    return x;
}

// Find the peaks of a spline with unit coefficients (segments, joints, ORDER): its rates at the waypoints, and every extremum
// that may come near to the worst rate of its own part, or to a position limit. The waypoints with given velocities cut it
// into parts. Such a velocity is no peak: no duration changes it.
template <int64_t K>
static inline int spline_peaks(int64_t segments, int64_t joints, const double* h, const int64_t* given, const double* unit,
                               const double* span, const SplineLimits& limits, SplinePeaks& peaks) {
    constexpr int64_t DEGREE = 2 * K + 1, ORDER = DEGREE + 1;
    const int64_t rates = limits.rates, rows = segments * joints;
    Scratch<double> derivatives(rows * ORDER * ORDER), ratios(rates * rows * 2), worst(segments), matrix(ORDER * ORDER);
    if (!derivatives || !ratios || !worst || !matrix) return NO_MEMORY;
    bernstein_matrix(ORDER, matrix.data);
    auto of = [&](int64_t row, int64_t d) { return derivatives.data + (row * ORDER + d) * ORDER; };
    auto limit = [&](int64_t d, int64_t row, double value) {
        return (value < 0.0 ? limits.lower : limits.upper)[(d - 1) * rows + row];
    };
    auto ratio = [&](int64_t d, int64_t row, int64_t end) -> double& { return ratios[((d - 1) * rows + row) * 2 + end]; };
    for (int64_t row = 0; row < rows; row++) {
        memcpy(of(row, 0), unit + row * ORDER, ORDER * sizeof(double));
        for (int64_t d = 1; d < ORDER; d++) {
            for (int64_t e = 0; e + 1 < ORDER; e++) of(row, d)[e] = (double)(e + 1) * of(row, d - 1)[e + 1];
            of(row, d)[ORDER - 1] = 0.0;
        }
    }
    for (int64_t s = 0; s < segments; s++) {
        worst[s] = 0.0;
        for (int64_t row = s * joints; row < (s + 1) * joints; row++)
            for (int64_t d = 1; d <= rates; d++)
                for (int64_t end = 0; end < 2; end++) {
                    double value = of(row, d)[0];
                    for (int64_t e = 1; end && e < ORDER; e++) value += of(row, d)[e];
                    const double used = value / (limit(d, row, value) * raised(h[s], d));
                    ratio(d, row, end) = used;
                    worst[s] = fmax(worst[s], d == 1 ? used : d == 2 ? sqrt(used) : cbrt(used));
                }
    }
    for (int64_t first = 0; first < segments;) {  // the worst of each part
        int64_t end = first + 1;
        double most = worst[first];
        for (; end < segments && !given[end - 1]; end++) most = fmax(most, worst[end]);
        for (; first < end; first++) worst[first] = most;
    }
    auto add = [&](int64_t s, int64_t j, int64_t d, double u) {
        const int64_t row = s * joints + j;
        const double value = horner(of(row, d), ORDER, u) / raised(h[s], d);
        double excess, weight;
        if (d == 0) {
            const double above = value - limits.position[joints + j], below = limits.position[j] - value;
            excess = fmax(above, below) / span[j];
            weight = (above > below ? 1.0 : -1.0) / span[j];
        } else {
            excess = log(value / limit(d, row, value)) / (double)d;
            weight = 1.0 / ((double)d * value);
        }
        const int64_t i = peaks.count++;
        peaks.segment[i] = s; peaks.joint[i] = j; peaks.order[i] = d;
        peaks.u[i] = u; peaks.value[i] = value; peaks.excess[i] = excess; peaks.weight[i] = weight;
    };
    peaks.count = 0;
    for (int64_t d = 1; d <= rates; d++)
        for (int64_t s = 0; s < segments; s++)
            for (int64_t j = 0; j < joints; j++) {
                // At a waypoint on the side where the limit is narrower; on both where rates may jump.
                const int64_t row = s * joints + j;
                const bool starts = s == 0 || (given[s - 1] ? d > 1 : ratio(d, row, 0) > ratio(d, row - joints, 1));
                const bool ends =
                    s + 1 == segments || (given[s] ? d > 1 : !(ratio(d, row + joints, 0) > ratio(d, row, 1)));
                if (starts) add(s, j, d, 0.0);
                if (ends) add(s, j, d, 1.0);
            }
    for (int64_t s = 0; s < segments; s++)
        for (int64_t j = 0; j < joints; j++) {
            const int64_t row = s * joints + j;
            bool matters = false;
            for (int64_t d = 1; d <= rates && !matters; d++) {
                const double narrower = fmin(-limit(d, row, -1.0), limit(d, row, 1.0)) * raised(h[s], d);
                const double near = raised(limits.near * worst[s], d) * narrower;
                for (int64_t i = 0; i < ORDER && !matters; i++) {
                    double control = of(row, d)[0];
                    for (int64_t e = 1; e <= i; e++) control += of(row, d)[e] * matrix[e * ORDER + i];
                    matters = fabs(control) > near;
                }
            }
            bool may_leave = false;
            const double room = limits.near_position * span[j];
            for (int64_t i = 0; i < ORDER; i++) {
                double control = unit[row * ORDER];
                for (int64_t e = 1; e <= i; e++) control += unit[row * ORDER + e] * matrix[e * ORDER + i];
                may_leave |= control > limits.position[joints + j] - room || control < limits.position[j] + room;
            }
            if (!matters && !may_leave) continue;
            // The extrema of each derivative lie between those of the next.
            double brackets[ORDER + 1] = {0.0, 1.0}, extrema[ORDER];
            int64_t between = 1;
            for (int64_t d = DEGREE - 2; d >= (may_leave ? 0 : 1); d--) {
                int64_t found = 0;
                for (int64_t i = 0; i < between; i++) {
                    const double root =
                        root_between(of(row, d + 1), of(row, d + 2), ORDER, brackets[i], brackets[i + 1], limits);
                    if (root == 0.0) continue;
                    extrema[found++] = root;
                    const bool is_given = d == 1 && ((s > 0 && given[s - 1] && root < limits.at_waypoint) ||
                                                     (s + 1 < segments && given[s] && root > 1.0 - limits.at_waypoint));
                    if (d <= rates && !is_given) add(s, j, d, root);
                }
                memcpy(brackets + 1, extrema, found * sizeof(double));
                brackets[found + 1] = 1.0;
                between = found + 1;
            }
        }
    return OK;
}
