// Local search for the order of tasks and their states: see planner/tasks/search.py.
#pragma once
#include <time.h>
#include "vectors.hpp"

struct OrderProblem {
    int64_t states, tasks;
    const double* durations;                      // (states, states), from the row to the column
    const int64_t *opposites, *task_of, *states_of;  // (states), (states), (tasks + 1): the first state of each task
    int64_t rules;
    const int64_t *before, *after, *group_of;     // (rules), (rules), (tasks): -1 for none
    int64_t lengths;
    const int64_t* moved;                         // (lengths): numbers of tasks that are moved together
};

// A part of an order, from one place to another, that is reversed or not and then stands behind a place.
struct OrderStep { int64_t first, last, behind; bool is_reversed; };

struct OrderSearch {
    static constexpr double LEAST_GAIN = 1e-9;  // s
    const OrderProblem& in;
    int64_t *chosen, *flags;  // (tasks), (tasks): whether the steps next to a task are still to be tried
    double deadline;  // s on the monotonic clock
    Scratch<int64_t> other, place, origin, rows;
    Scratch<double> inner, inner_back, reached;
    OrderSearch(const OrderProblem& in, int64_t* chosen, int64_t* flags, double deadline)
        : in(in), chosen(chosen), flags(flags), deadline(deadline), other(in.tasks), place(in.tasks), origin(in.states), rows(in.tasks),
          inner(in.tasks), inner_back(in.tasks), reached(in.states) {}
    explicit operator bool() const { return other && place && origin && rows && inner && inner_back && reached; }

    double cost(int64_t a, int64_t b) const { return in.durations[a * in.states + b]; }
    int64_t back(int64_t k) const { return in.opposites[chosen[k]]; }

    void run() {
        add_up();
        choose_states();
        do {
            add_up();
            bool is_settled = false;
            while (!is_settled) {
                is_settled = true;
                for (int64_t k = 1; k < in.tasks - 1; k++) {
                    int64_t& flag = flags[in.task_of[chosen[k]]];
                    if (!flag) continue;
                    if (is_late()) return;
                    flag = 0;
                    if (improve(k)) is_settled = false;
                }
            }
        } while (choose_states());
    }

    bool is_late() const {
        timespec now;
        clock_gettime(CLOCK_MONOTONIC, &now);
        return now.tv_sec + 1e-9 * now.tv_nsec >= deadline;
    }

    // The durations from the first place to each other one: as chosen, and in the opposite direction.
    void add_up() {
        inner[0] = inner_back[0] = 0.0;
        for (int64_t k = 1; k < in.tasks; k++) {
            inner[k] = inner[k - 1] + cost(chosen[k - 1], chosen[k]);
            inner_back[k] = inner_back[k - 1] + cost(back(k), back(k - 1));
        }
    }

    double edge(int64_t k) { return inner[k + 1] - inner[k]; }

    // What a step saves; of a step that saves less than `enough`, any number below.
    double gain(const OrderStep& step, double enough) {
        const auto [first, last, behind, is_reversed] = step;
        double left = edge(first - 1) + edge(last);
        int64_t before = first - 1, after = last + 1;
        if (behind != first - 1) {
            left += edge(behind) - cost(chosen[first - 1], chosen[last + 1]);
            before = behind;
            after = behind + 1;
        }
        if (is_reversed) left -= inner_back[last] - inner_back[first] - (inner[last] - inner[first]);
        if (left <= enough) return left;
        left -= cost(chosen[before], is_reversed ? back(last) : chosen[first]);
        if (left <= enough) return left;
        return left - cost(is_reversed ? back(first) : chosen[last], chosen[after]);
    }

    // Write the order after a step to `other`.
    void apply(const OrderStep& step) {
        const int64_t first = step.first, last = step.last, behind = step.behind;
        int64_t count = 0;
        const auto put = [&](int64_t from, int64_t to) { for (int64_t k = from; k <= to; k++) other[count++] = chosen[k]; };
        const auto put_part = [&] {
            if (!step.is_reversed) return put(first, last);
            for (int64_t k = last; k >= first; k--) other[count++] = back(k);
        };
        if (behind >= first) {
            put(0, first - 1);
            put(last + 1, behind);
            put_part();
            put(behind + 1, in.tasks - 1);
        } else {
            put(0, behind);
            put_part();
            put(behind + 1, first - 1);
            put(last + 1, in.tasks - 1);
        }
    }

    // Whether the rules allow the order in `other`.
    bool is_allowed() {
        for (int64_t k = 0; k < in.tasks; k++) place[in.task_of[other[k]]] = k;
        for (int64_t r = 0; r < in.rules; r++) if (place[in.before[r]] > place[in.after[r]]) return false;
        int64_t changes = 0;  // of the group from place to place: each group is left once
        for (int64_t k = 1; k < in.tasks; k++) {
            const int64_t group = in.group_of[in.task_of[other[k - 1]]];
            changes += group >= 0 && group != in.group_of[in.task_of[other[k]]];
        }
        return changes <= groups();
    }

    int64_t groups() const {
        int64_t most = -1;
        for (int64_t t = 0; t < in.tasks; t++) most = in.group_of[t] > most ? in.group_of[t] : most;
        return most + 1;
    }

    bool has_rules() const { return in.rules > 0 || groups() > 0; }

    // Make the best step that changes an order next to a place, if one saves time.
    bool improve(int64_t k) {
        const int64_t end = in.tasks - 1;
        const bool ruled = has_rules();
        double most = LEAST_GAIN;
        OrderStep best{0, 0, 0, false};
        const auto consider = [&](const OrderStep& step) {
            const double saved = gain(step, most);
            if (!(saved > most)) return;
            if (ruled) {
                apply(step);
                if (!is_allowed()) return;
            }
            most = saved;
            best = step;
        };
        const auto move = [&](int64_t first, int64_t length, int64_t behind) {
            const int64_t last = first + length - 1;
            if (first < 1 || last >= end || behind < 0 || behind >= end || (behind >= first - 1 && behind <= last)) return;
            consider({first, last, behind, false});
            consider({first, last, behind, true});
        };
        for (int64_t j = 1; j < end; j++) consider(j < k ? OrderStep{j, k, j - 1, true} : OrderStep{k, j, k - 1, true});
        for (int64_t j = 1; j < end; j++) {
            move(j, 1, k);
            move(j, 1, k - 1);
        }
        for (int64_t l = 0; l < in.lengths; l++) {
            const int64_t length = in.moved[l];
            for (int64_t j = 0; j < end; j++) {
                move(k, length, j);
                if (length > 1) move(k - length + 1, length, j);
            }
        }
        if (!best.first) return false;
        const int64_t changed[] = {best.first - 1, best.first, best.last, best.last + 1, best.behind, best.behind + 1};
        for (const int64_t at : changed) flags[in.task_of[chosen[at]]] = 1;
        apply(best);
        memcpy(chosen, other.data, in.tasks * sizeof(int64_t));
        add_up();
        return true;
    }

    // Choose the states for the order by dynamic programming; return whether that saves time.
    bool choose_states() {
        const auto first = [&](int64_t k) { return in.states_of[in.task_of[chosen[k]]]; };
        const auto last = [&](int64_t k) { return in.states_of[in.task_of[chosen[k]] + 1]; };
        for (int64_t b = first(0); b < last(0); b++) reached[b] = 0.0;
        for (int64_t k = 1; k < in.tasks; k++) {
            for (int64_t b = first(k); b < last(k); b++) reached[b] = INFINITY;
            for (int64_t a = first(k - 1); a < last(k - 1); a++) {
                for (int64_t b = first(k); b < last(k); b++) {
                    const double there = reached[a] + cost(a, b);
                    if (!(there < reached[b])) continue;
                    reached[b] = there;
                    origin[b] = a;
                }
            }
        }
        const int64_t end = in.tasks - 1;
        int64_t state = first(end);
        for (int64_t b = first(end); b < last(end); b++) if (reached[b] < reached[state]) state = b;
        if (!(reached[state] < inner[end] - LEAST_GAIN)) return false;
        for (int64_t k = end; k >= 0; k--) {
            if (chosen[k] != state) {
                for (int64_t at = k - 1; at <= k + 1; at++) if (at >= 0 && at <= end) flags[in.task_of[chosen[at]]] = 1;
            }
            rows[k] = state;
            state = origin[state];
        }
        memcpy(chosen, rows.data, in.tasks * sizeof(int64_t));
        return true;
    }
};

// The least over the states of two tasks of the largest distance of a joint, from the row's exits to the column's entries.
// Exits (states, joints); entries (blocks, joints, W), the last state of a task repeated to fill its last block.
static void least_distances(int64_t tasks, int64_t joints, const int64_t* states_of, const double* exits,
                            const int64_t* blocks_of, const double* entries, double* least) {
    for (int64_t s = 0; s < tasks; s++) {
        for (int64_t t = 0; t < tasks; t++) {
            V nearest = splat(INFINITY);
            for (int64_t a = states_of[s]; a < states_of[s + 1]; a++) {
                for (int64_t block = blocks_of[t]; block < blocks_of[t + 1]; block++) {
                    V longest = splat(0.0);
                    for (int64_t j = 0; j < joints; j++) {
                        V there;
                        memcpy(&there, entries + (block * joints + j) * W, sizeof(V));
                        const V away = splat(exits[a * joints + j]) - there;
                        const V size = select((VI)(away < splat(0.0)), -away, away);
                        longest = select((VI)(size > longest), size, longest);
                    }
                    nearest = select((VI)(longest < nearest), longest, nearest);
                }
            }
            double& found = least[s * tasks + t];
            found = nearest[0];
            for (int64_t i = 1; i < W; i++) found = nearest[i] < found ? nearest[i] : found;
        }
    }
}
