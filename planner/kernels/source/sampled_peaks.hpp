// Peaks of functions that are sampled coarsely, and finer wherever what lies between samples could matter. The caller
// computes the samples: it takes the times that are wanted and gives the values, round by round.
#pragma once
#include "vectors.hpp"

constexpr int TOO_MANY = 2;

struct Accuracy {  // SEARCH_NUMBERS of planner/kernels/sampled_peaks.py
    double coarser, finer, most_rounds, caution, off_parabola, known_to, decided_at, slowing, least_bend, most_samples,
        bend_column, bend_power, rounding;
};
constexpr int64_t BENDS = 3;  // columns after the functions that tell how much bends may use

struct PeakSearch {
    int64_t pieces, columns, width, groups, quantities;  // width: columns and those of bends
    Accuracy a;
    int64_t triples, wanted, round;
    // Of pieces, columns and groups; peaks (groups, quantities); of triples; of wanted samples; of triples that are left.
    int64_t *parts, *group, *quantity, *at_piece, *at_column, *piece, *sample_piece, *left;
    double *above, *scale, *best, *at_unit, *start, *step, *values, *unit;

    template <class T> static bool grow(T*& array, int64_t count) {
        T* larger = static_cast<T*>(realloc(array, (count + 1) * sizeof(T)));
        if (larger) array = larger;
        return larger != nullptr;
    }
    template <class T> static bool copy(T*& array, const T* from, int64_t count) {
        if (!grow(array, count)) return false;
        memcpy(array, from, count * sizeof(T));
        return true;
    }

    bool set(const int64_t* parts_, const int64_t* group_, const int64_t* quantity_, const double* above_) {
        if (!copy(parts, parts_, pieces) || !copy(group, group_, pieces) || !copy(quantity, quantity_, columns) ||
            !copy(above, above_, groups) || !grow(scale, width) || !grow(best, groups * quantities) ||
            !grow(at_piece, groups * quantities) || !grow(at_column, groups * quantities) ||
            !grow(at_unit, groups * quantities))
            return false;
        for (int64_t k = 0; k < groups * quantities; k++) {
            best[k] = at_unit[k] = 0.0;
            at_column[k] = 0;
            at_piece[k] = -1;
        }
        for (int64_t p = 0; p < pieces; p++) wanted += 2 * coarse(p) + 1;
        if (!grow(sample_piece, wanted) || !grow(unit, wanted)) return false;
        int64_t n = 0;
        for (int64_t p = 0; p < pieces; p++)
            for (int64_t k = 0; k <= 2 * coarse(p); k++, n++) {
                sample_piece[n] = p;
                unit[n] = (double)k / (double)(2 * coarse(p));
            }
        return true;
    }
    int64_t coarse(int64_t p) const { return (parts[p] + (int64_t)a.coarser - 1) / (int64_t)a.coarser; }

    // Take values (wanted, width) of the samples, and say which samples are wanted next.
    int take(const double* given) {
        for (int64_t i = 0; i < wanted; i++) {
            const int64_t g = group[sample_piece[i]];
            for (int64_t c = 0; c < columns; c++) {
                const double x = isnan(given[i * width + c]) ? (double)INFINITY : fabs(given[i * width + c]);
                const int64_t at = g * quantities + quantity[c];
                if (at_piece[at] < 0 || x > best[at]) {
                    best[at] = x; at_piece[at] = sample_piece[i]; at_unit[at] = unit[i]; at_column[at] = c;
                }
            }
        }
        return round == 0 ? first_triples(given) : split(given);
    }
    int first_triples(const double* given) {
        for (int64_t c = 0; c < width; c++) scale[c] = 0.0;
        for (int64_t i = 0; i < wanted; i++)
            for (int64_t c = 0; c < width; c++) scale[c] = fmax(scale[c], fabs(given[i * width + c]));
        for (int64_t p = 0; p < pieces; p++) triples += coarse(p);
        if (!grow_triples(triples)) return NO_MEMORY;
        int64_t t = 0, sample = 0;
        for (int64_t p = 0; p < pieces; p++, sample++)
            for (int64_t k = 0; k < coarse(p); k++, t++, sample += 2) {
                piece[t] = p;
                start[t] = unit[sample];
                step[t] = 0.5 / (double)coarse(p);
                memcpy(values + t * 3 * width, given + sample * width, 3 * width * sizeof(double));
            }
        return next();
    }
    bool grow_triples(int64_t n) {
        return grow(piece, n) && grow(start, n) && grow(step, n) && grow(values, n * 3 * width);
    }
    // Each triple that was left becomes `finer` of them, with the new values between.
    int split(const double* given) {
        const int64_t finer = (int64_t)a.finer, kept = triples, between = 2 * (finer - 1);
        int64_t *pieces_ = nullptr, n = 0;
        double *starts = nullptr, *steps = nullptr, *old = values;
        values = nullptr;
        if (!grow(pieces_, kept * finer) || !grow(starts, kept * finer) || !grow(steps, kept * finer) ||
            !grow(values, kept * finer * 3 * width)) {
            free(pieces_); free(starts); free(steps); free(old);
            return NO_MEMORY;
        }
        auto sample = [&](int64_t t, int64_t k) -> const double* {
            if (k % finer == 0) return old + (left[t] * 3 + k / finer) * width;
            return given + (t * between + k - 1 - (k > finer)) * width;
        };
        for (int64_t t = 0; t < kept; t++)
            for (int64_t f = 0; f < finer; f++, n++) {
                pieces_[n] = piece[left[t]];
                steps[n] = step[left[t]] / (double)finer;
                starts[n] = start[left[t]] + 2.0 * (double)f * steps[n];
                for (int64_t k = 0; k < 3; k++)
                    memcpy(values + (n * 3 + k) * width, sample(t, 2 * f + k), width * sizeof(double));
            }
        free(piece); free(start); free(step); free(old);
        piece = pieces_; start = starts; step = steps;
        triples = n;
        return next();
    }
    // Whether between the samples of a triple something could matter that is not known yet.
    bool is_open(int64_t t) const {
        const int64_t p = piece[t], g = group[p];
        const double *x = values + t * 3 * width, *y = x + width, *z = y + width, coarseness = step[t] * 2.0 * parts[p];
        const double off = a.off_parabola * fmax(coarseness * coarseness * coarseness - 1.0, 0.0);
        auto room = [&](int64_t c) {
            const double largest = fmax(fmax(fabs(x[c]), fabs(y[c])), fabs(z[c]));
            return largest + a.caution * (fabs(x[c] - 2.0 * y[c] + z[c]) / 8.0 + off * scale[c]);
        };
        for (int64_t c = 0; c < columns; c++) {
            const double most = best[g * quantities + quantity[c]];
            double enough = fmax(most * (1.0 + a.known_to), above[g]), use = room(c);
            if (most <= a.decided_at) enough = fmin(enough, a.decided_at);
            if (c == (int64_t)a.bend_column) {
                use = fmax(use, pow(bend(x, y, z, step[t] * room(columns + 2), room(columns + 1)), a.bend_power));
                if (has_corner(x, y, z, c)) use = fmax(use, pow(room(columns), 2.0 * a.bend_power));
            }
            if (use > enough) return true;
        }
        return false;
    }
    // Use of the limit of the acceleration across the path by bends within a moment, where the tool is slow.
    double bend(const double* x, const double* y, const double* z, double slower, double acceleration) const {
        const double fast = fmax(fmax(x[columns], y[columns]), z[columns]), slow = fmin(fmin(x[columns], y[columns]), z[columns]);
        const double bound = fmin(acceleration, (fast + slower) * (fast + slower));
        return slower > a.slowing * slow && bound > a.least_bend ? bound : 0.0;
    }
    // Whether the tightest bend bounds the acceleration across the path at some of three samples, and not at all of them: in
    // between it has a corner, up to which it grows with the square of the speed.
    bool has_corner(const double* x, const double* y, const double* z, int64_t c) const {
        const double* samples[3] = {x, y, z};
        int64_t bounded = 0;
        for (const double* at : samples) bounded += fabs(at[c]) >= (1.0 - a.rounding) * pow(at[columns], 2.0 * a.bend_power);
        return bounded % 3 != 0;
    }
    int next() {
        wanted = 0;
        if (round++ == (int64_t)a.most_rounds) return OK;
        if (!grow(left, triples)) return NO_MEMORY;
        int64_t n = 0;
        for (int64_t t = 0; t < triples; t++)
            if (is_open(t)) left[n++] = t;
        const int64_t finer = (int64_t)a.finer, count = n * 2 * (finer - 1);
        if ((double)count > a.most_samples) return TOO_MANY;
        if (!grow(sample_piece, count) || !grow(unit, count)) return NO_MEMORY;
        for (int64_t t = 0; t < n; t++)
            for (int64_t k = 0; k < 2 * finer; k++) {
                if (k % finer == 0) continue;
                sample_piece[wanted] = piece[left[t]];
                unit[wanted++] = start[left[t]] + (double)k * (step[left[t]] / finer);
            }
        triples = n;
        return OK;
    }
    void release() {
        free(parts); free(group); free(quantity); free(at_piece); free(at_column); free(piece); free(sample_piece);
        free(left); free(above); free(scale); free(best); free(at_unit); free(start); free(step); free(values); free(unit);
    }
};
