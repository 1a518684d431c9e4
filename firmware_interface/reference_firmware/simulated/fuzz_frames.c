/* Fuzzes the board with whatever may come over its line: noise, frames, commands in any order, and
 * whole motions with hostile numbers and accidents in between. fuzz_invariants.c says what must
 * hold. Usage: fuzz_frames [--inputs N | --seconds S] [--seed N]
 *
 * Every BATCH inputs begin anew with the next seed, so that a finding repeats within seconds. */
#define _POSIX_C_SOURCE 199309L

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fuzz_invariants.h"
#include "fuzz_plays.h"
#include "fuzz_values.h"
#include "simulation.h"

#define BATCH 20000ul

static unsigned long seed = 1, limit, inputs;
static double limit_s;
static volatile sig_atomic_t ended; /* by a signal: what was done until then is reported */

static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* A finding: says how to have it again. */
static void on_abort(int number)
{
    char text[100];
    const int length =
        snprintf(text, sizeof text, "again with: --inputs %lu --seed %lu\n", BATCH, seed);
    fwrite(text, 1, (size_t)length, stderr);
    signal(number, SIG_DFL);
    raise(number);
}

static void on_end(int number)
{
    (void)number;
    ended = 1;
}

static unsigned long batch(unsigned long size)
{
    unsigned long count = 0;
    fuzz_seed(seed);
    simulation_reset();
    invariants_watch();
    simulation_power_cycle();
    while (count < size) {
        count += fuzz_play();
    }
    return count;
}

static void report(double duration_s)
{
    const struct seen *seen = &invariants_seen;
    printf("%lu inputs in %.0f s, %lu replies, %lu of them exceptions, ", inputs, duration_s,
           seen->replies, seen->exceptions);
    printf("%lu enabled, %lu trajectories outside the limits, %lu starts, "
           "%lu exchanges of gains on the way to rest, ",
           seen->enables, seen->refused_trajectories, seen->starts, seen->exchanges);
    printf("samples: %lu with effort, %lu in motion, %lu in fault; nothing found\n",
           seen->samples_with_effort, seen->samples_in_motion, seen->samples_in_fault);
}

/* Options come in pairs of name and number. */
static void parse(int count, char **words)
{
    for (int n = 1; n + 1 < count; n += 2) {
        if (strcmp(words[n], "--inputs") == 0) {
            limit = strtoul(words[n + 1], NULL, 10);
        } else if (strcmp(words[n], "--seconds") == 0) {
            limit_s = strtod(words[n + 1], NULL);
        } else if (strcmp(words[n], "--seed") == 0) {
            seed = strtoul(words[n + 1], NULL, 10);
        }
    }
}

int main(int count, char **words)
{
    parse(count, words);
    if (limit == 0 && !(limit_s > 0.0)) {
        fprintf(stderr, "usage: %s [--inputs N | --seconds S] [--seed N]\n", words[0]);
        return 2;
    }
    const double start_s = now_s();
    signal(SIGABRT, on_abort);
    signal(SIGINT, on_end);
    signal(SIGTERM, on_end);
    for (; !ended && (inputs < limit || now_s() - start_s < limit_s); seed++) {
        inputs += batch(limit > 0 && limit - inputs < BATCH ? limit - inputs : BATCH);
    }
    report(now_s() - start_s);
    return EXIT_SUCCESS;
}
