// The cheapest way through layers of joint positions: see planner/tool_motions/redundancy/way.py.
#pragma once
#include "vectors.hpp"

struct LayeredGraph {
    int64_t layers, joints;
    const int64_t* first_of;       // (layers + 1): the first state of each layer, and the number of states
    const double *fewest, *most;   // (states, joints): whole turns that keep each angle within its limits
    const double* costs;           // (states)
    const double* weights;         // (joints), of squared steps
    const double* furthest;        // (joints): the largest step of a joint from layer to layer
};

// The cost of a step to a state, whose angles are first turned next to those before; infinite where it is too long or no cheaper.
static double step_cost(const LayeredGraph& in, const double* from, const double* to, int64_t state, double enough, double* turned) {
    constexpr double TURN = 6.283185307179586;
    const double *fewest = in.fewest + state * in.joints, *most = in.most + state * in.joints;
    double sum = 0.0;
    for (int64_t j = 0; j < in.joints; j++) {
        const double turns = fmin(fmax(rint((from[j] - to[j]) / TURN), fewest[j]), most[j]);
        turned[j] = to[j] + TURN * turns;
        const double way = fabs(turned[j] - from[j]);
        if (!(way <= in.furthest[j])) return INFINITY;
        sum += way * way * in.weights[j];
        if (sum >= enough) return INFINITY;
    }
    return sum;
}

// Put indices in the ascending order of their totals, equal ones by index (heapsort, Williams 1964).
static void sort_by_total(int64_t* order, int64_t count, const double* totals) {
    const auto is_before = [&](int64_t a, int64_t b) { return totals[a] < totals[b] || (totals[a] == totals[b] && a < b); };
    const auto sink = [&](int64_t root, int64_t end) {
        for (int64_t child; (child = 2 * root + 1) < end; root = child) {
            if (child + 1 < end && is_before(order[child], order[child + 1])) child++;
            if (!is_before(order[root], order[child])) return;
            const int64_t other = order[root];
            order[root] = order[child];
            order[child] = other;
        }
    };
    for (int64_t root = count / 2; root-- > 0;) sink(root, count);
    for (int64_t end = count; --end > 0;) {
        const int64_t largest = order[0];
        order[0] = order[end];
        order[end] = largest;
        sink(0, end);
    }
}

// Dynamic programming from layer to layer (Bellman 1957). Origins come in the order of their costs: where one alone costs as
// much as the best way found, no later one leads to a better.
static int cheapest_ways(const LayeredGraph& in, double* positions, double* totals, int64_t* origins) {
    int64_t widest = 1;
    for (int64_t k = 0; k < in.layers; k++) if (in.first_of[k + 1] - in.first_of[k] > widest) widest = in.first_of[k + 1] - in.first_of[k];
    Scratch<int64_t> order(widest);
    Scratch<double> one(in.joints), other(in.joints);
    if (!order || !one || !other) return NO_MEMORY;
    double *turned = one.data, *best_turned = other.data;
    for (int64_t i = 0; i < in.first_of[1]; i++) { totals[i] = in.costs[i]; origins[i] = -1; }
    for (int64_t k = 1; k < in.layers; k++) {
        int64_t count = 0;
        for (int64_t i = in.first_of[k - 1]; i < in.first_of[k]; i++)
            if (isfinite(totals[i])) order[count++] = i;
        sort_by_total(order.data, count, totals);
        for (int64_t i = in.first_of[k]; i < in.first_of[k + 1]; i++) {
            double best = INFINITY;
            int64_t origin = -1;
            double* to = positions + i * in.joints;
            for (int64_t n = 0; n < count && totals[order[n]] < best; n++) {
                const int64_t from = order[n];
                const double cost = totals[from] + step_cost(in, positions + from * in.joints, to, i, best - totals[from], turned);
                if (!(cost < best)) continue;
                best = cost;
                origin = from;
                double* const before = best_turned;
                best_turned = turned;
                turned = before;
            }
            totals[i] = best + in.costs[i];
            origins[i] = origin;
            if (origin >= 0) memcpy(to, best_turned, in.joints * sizeof(double));
        }
    }
    return OK;
}
