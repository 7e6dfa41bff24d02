// Quadratic programs by a primal-dual interior-point method without slack variables (Nocedal and Wright, Numerical
// Optimization, 2006, ch. 16.6).
#pragma once
#include "vectors.hpp"

// The sum of products of two rows, four at a time.
static inline double dot(const double* a, const double* b, int64_t count) {
    V sums = splat(0.0);
    int64_t i = 0;
    for (; i + W <= count; i += W) {
        V x, y;
        memcpy(&x, a + i, sizeof(V));
        memcpy(&y, b + i, sizeof(V));
        sums += x * y;
    }
    double sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
    for (; i < count; i++) sum += a[i] * b[i];
    return sum;
}

// A positive definite matrix (size, size), of whose rows only what stands between the first element that may not be 0 and
// the diagonal is stored: elimination fills nothing else.
struct Envelope {
    int64_t size;
    Scratch<int64_t> first, start;
    Scratch<double> elements;
    explicit Envelope(int64_t size, const int64_t* firsts, int64_t stored)
        : size(size), first(size), start(size), elements(stored) {
        if (!*this || !firsts) return;
        for (int64_t i = 0, at = 0; i < size; at += i - firsts[i] + 1, i++) { first[i] = firsts[i]; start[i] = at - firsts[i]; }
    }
    explicit operator bool() const { return first && start && elements; }
    double* row(int64_t i) { return elements.data + start[i]; }  // indexed by columns

    // Replace the matrix by its Cholesky factor. False: it is not positive definite, for the numbers.
    bool factorise() {
        for (int64_t i = 0; i < size; i++) {
            double* own = row(i);
            for (int64_t j = first[i]; j <= i; j++) {
                const int64_t from = first[i] > first[j] ? first[i] : first[j];
                const double left = own[j] - dot(own + from, row(j) + from, j - from);
                if (j == i && !(left > 0.0)) return false;
                own[j] = j < i ? left / row(j)[j] : sqrt(left);
            }
        }
        return true;
    }

    void solve(double* x) {
        for (int64_t i = 0; i < size; i++) x[i] = (x[i] - dot(row(i) + first[i], x + first[i], i - first[i])) / row(i)[i];
        for (int64_t i = size - 1; i >= 0; i--) {
            x[i] /= row(i)[i];
            for (int64_t j = first[i]; j < i; j++) x[j] -= row(i)[j] * x[i];
        }
    }
};

// The share of a step, at most 1, up to a share of the way to where a positive value is 0.
static inline double longest_step(const double* values, const double* changes, int64_t count, double share_to_boundary) {
    double fastest = 0.0;
    for (int64_t i = 0; i < count; i++) fastest = fmax(fastest, -changes[i] / values[i]);
    return fastest <= share_to_boundary ? 1.0 : share_to_boundary / fastest;
}

struct Gap { double least, share, reference; };  // of `solve_quadratic_program`

// Minimise cost . x + curvature . x^2 / 2 where matrix x <= bounds and lower <= x <= upper, from x on, which is within all of
// them. Rows of the matrix that are 0 but next to each other and in the last column make the Newton systems quick to solve.
static inline int quadratic_program(int64_t variables, int64_t count, const double* cost, const double* curvature,
                                    const double* matrix, const double* bounds, const double* lower, const double* upper,
                                    const double* gap, double* x) {
    constexpr double SHARE_TO_BOUNDARY = 0.99;  // of a step: the next one begins inside, too
    constexpr double CENTRING = 0.03;           // share of the mean complementarity that is the next barrier
    constexpr int64_t MOST_STEPS = 25;          // 8 to 12 are common
    const Gap& wanted = *reinterpret_cast<const Gap*>(gap);
    const int64_t n = variables, all = count + 2 * n, last = n - 1;
    Scratch<int64_t> begin(count), end(count), first(n);
    Scratch<double> slacks(all), duals(all), push(all), stiffness(all), changes(all), dual_changes(all), step(n);
    if (!begin || !end || !first || !slacks || !duals || !push || !stiffness || !changes || !dual_changes || !step)
        return NO_MEMORY;
    for (int64_t i = 0; i < n; i++) first[i] = i < last ? i : 0;
    for (int64_t r = 0; r < count; r++) {
        const double* row = matrix + r * n;
        begin[r] = 0; end[r] = last;
        while (begin[r] < last && row[begin[r]] == 0.0) begin[r]++;
        while (end[r] > begin[r] && row[end[r] - 1] == 0.0) end[r]--;
        for (int64_t i = begin[r]; i < end[r]; i++) first[i] = first[i] < begin[r] ? first[i] : begin[r];
    }
    int64_t stored = 0;
    for (int64_t i = 0; i < n; i++) stored += i - first[i] + 1;
    Envelope system(n, first.data, stored);
    if (!system) return NO_MEMORY;
    auto product = [&](int64_t r, const double* y) {
        const double* row = matrix + r * n;
        return dot(row + begin[r], y + begin[r], end[r] - begin[r]) + row[last] * y[last];
    };
    auto set_slacks = [&] {
        double least = INFINITY;
        for (int64_t r = 0; r < count; r++) slacks[r] = bounds[r] - product(r, x);
        for (int64_t i = 0; i < n; i++) { slacks[count + i] = x[i] - lower[i]; slacks[count + n + i] = upper[i] - x[i]; }
        for (int64_t i = 0; i < all; i++) least = slacks[i] > 0.0 ? fmin(least, slacks[i]) : -1.0;
        return least > 0.0;
    };
    if (!set_slacks()) return OK;  // so far from 1 that rounding puts the start onto a limit
    for (int64_t i = 0; i < all; i++) duals[i] = 1.0 / (double)all / slacks[i];
    for (int64_t k = 0; k < MOST_STEPS; k++) {
        const double barrier = CENTRING * dot(slacks.data, duals.data, all) / (double)all;
        for (int64_t i = 0; i < all; i++) { push[i] = barrier / slacks[i]; stiffness[i] = duals[i] / slacks[i]; }
        memset(system.elements.data, 0, stored * sizeof(double));
        for (int64_t i = 0; i < n; i++) {
            system.row(i)[i] = curvature[i] + stiffness[count + i] + stiffness[count + n + i];
            step[i] = -(cost[i] + curvature[i] * x[i]) + push[count + i] - push[count + n + i];
        }
        for (int64_t r = 0; r < count; r++) {
            const double* row = matrix + r * n;
            for (int64_t i = begin[r]; i < end[r]; i++) {
                const double weighted = stiffness[r] * row[i];
                for (int64_t j = begin[r]; j <= i; j++) system.row(i)[j] += weighted * row[j];
                step[i] -= row[i] * push[r];
            }
            const double weighted = stiffness[r] * row[last];
            for (int64_t j = begin[r]; j < end[r]; j++) system.row(last)[j] += weighted * row[j];
            system.row(last)[last] += weighted * row[last];
            step[last] -= row[last] * push[r];
        }
        if (!system.factorise()) break;  // the limits are too far from 1 for the numbers: it goes no nearer
        system.solve(step.data);
        for (int64_t r = 0; r < count; r++) changes[r] = -product(r, step.data);
        for (int64_t i = 0; i < n; i++) { changes[count + i] = step[i]; changes[count + n + i] = -step[i]; }
        for (int64_t i = 0; i < all; i++) dual_changes[i] = push[i] - duals[i] - stiffness[i] * changes[i];
        const double primal = longest_step(slacks.data, changes.data, all, SHARE_TO_BOUNDARY);
        const double dual = longest_step(duals.data, dual_changes.data, all, SHARE_TO_BOUNDARY);
        double value = 0.0;
        for (int64_t i = 0; i < n; i++) {
            x[i] += primal * step[i];
            value += x[i] * (cost[i] + 0.5 * curvature[i] * x[i]);
        }
        for (int64_t i = 0; i < all; i++) duals[i] += dual * dual_changes[i];
        set_slacks();
        if (barrier * (double)all < fmax(wanted.share * (wanted.reference - value), wanted.least)) break;
    }
    return OK;
}
