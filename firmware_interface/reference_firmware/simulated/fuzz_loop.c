/* A coverage-guided fuzzer for where there is no libFuzzer, with those of its options that
 * tools/fuzz.py gives: the same targets, the same corpus.
 *
 *   fuzz FILE...                                      run these inputs and say what was seen
 *   fuzz -max_total_time=S [-seed=N] DIR [DIR...]     change inputs of these folders; what reaches
 *                                                     something new goes to the first
 *   fuzz -merge=1 DIR FROM...                         copy what is needed to reach all that FROM does
 *
 * -max_len=N and -artifact_prefix=PATH as well. GCC's -fsanitize-coverage=trace-pc tells at every
 * branch of the firmware where it is; without it, all inputs reach the same. */
#define _POSIX_C_SOURCE 200809L

#include <dirent.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "fuzz_invariants.h"
#include "fuzz_targets.h"

#define EDGES (1u << 16)
#define LONGEST 4096u
#define MOST_INPUTS 20000u
#define PATIENCE_S 60u /* for one input */

struct input {
    size_t length;
    uint8_t *bytes;
};

static struct {
    double total_s;
    bool merge;
    size_t max_length;
    const char *prefix, *folder; /* of findings; of what is new */
} options = {0.0, false, 2048u, "", NULL};

static struct input inputs[MOST_INPUTS], found[MOST_INPUTS]; /* given; worth changing */
static unsigned given, kept;
static unsigned long runs;
static struct input current;

static void fail(const char *what, const char *path)
{
    fprintf(stderr, "%s: %s\n", path, what);
    exit(2);
}

/* ---- coverage */

static uint8_t hits[EDGES]; /* of the input that runs */
static uint8_t seen[EDGES]; /* of all, a bit for each magnitude */
static uintptr_t place;

void __sanitizer_cov_trace_pc(void); /* called by what the compiler inserts */

void __sanitizer_cov_trace_pc(void)
{
    const uintptr_t here =
        (uintptr_t)__builtin_return_address(0) - (uintptr_t)&LLVMFuzzerTestOneInput;
    const uintptr_t edge = (here * 2654435761u >> 8 ^ place) % EDGES;
    hits[edge] += hits[edge] < UINT8_MAX;
    place = (here * 2654435761u >> 8) >> 1;
}

static uint8_t magnitude(uint8_t count)
{
    uint8_t bit = 0;
    for (; count > 0 && (options.merge ? bit == 0 : bit < 7u); count >>= 1) {
        bit++;
    }
    return count == 0 && bit == 0 ? 0 : (uint8_t)(1u << (bit - 1u));
}

/* Run an input; true where it reaches what none did before. */
static bool reaches_new(struct input input)
{
    bool new = false;
    memset(hits, 0, sizeof hits);
    place = 0;
    current = input;
    runs++;
    alarm(PATIENCE_S);
    LLVMFuzzerTestOneInput(input.bytes, input.length);
    for (size_t n = 0; n < EDGES; n++) {
        const uint8_t bit = magnitude(hits[n]);
        new = new || (bit & ~seen[n]) != 0;
        seen[n] |= bit;
    }
    return new;
}

/* ---- files */

static void write_input(const char *folder, const char *kind, struct input input)
{
    uint64_t hash = 14695981039346656037u; /* FNV-1a */
    for (size_t n = 0; n < input.length; n++) {
        hash = (hash ^ input.bytes[n]) * 1099511628211u;
    }
    char path[1024];
    snprintf(path, sizeof path, "%s%s%016llx", folder, kind, (unsigned long long)hash);
    FILE *file = fopen(path, "wb");
    if (file == NULL || fwrite(input.bytes, 1, input.length, file) != input.length
        || fclose(file) != 0) {
        fail("cannot be written", path);
    }
    if (kind[0] != '/') {
        fprintf(stderr, "Test unit written to %s\n", path);
    }
}

/* A finding: what was run is written before the program ends. */
static void on_end(int number)
{
    signal(number, SIG_DFL);
    write_input(options.prefix, number == SIGALRM ? "timeout-" : "crash-", current);
    raise(number);
}

static struct input copy(const uint8_t *bytes, size_t length)
{
    struct input input = {length, malloc(length > 0 ? length : 1u)};
    if (input.bytes == NULL) {
        fail("no memory", "input");
    } else if (length > 0) {
        memcpy(input.bytes, bytes, length);
    }
    return input;
}

static void read_file(const char *path)
{
    uint8_t bytes[LONGEST];
    FILE *file = fopen(path, "rb");
    if (file == NULL || given == MOST_INPUTS) {
        fail("cannot be read", path);
        return;
    }
    const size_t length = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    inputs[given++] = copy(bytes, length);
}

static void read_folder(const char *path)
{
    DIR *folder = opendir(path);
    char name[1024];
    if (folder == NULL) {
        fail("cannot be read", path);
        return;
    }
    for (struct dirent *entry = readdir(folder); entry != NULL; entry = readdir(folder)) {
        struct stat status;
        snprintf(name, sizeof name, "%s/%s", path, entry->d_name);
        if (stat(name, &status) == 0 && S_ISREG(status.st_mode)) {
            read_file(name);
        }
    }
    closedir(folder);
}

/* Short ones first, then by their bytes: always in the same order. */
static int compare(const void *a, const void *b)
{
    const struct input *left = a, *right = b;
    if (left->length != right->length) {
        return left->length < right->length ? -1 : 1;
    }
    return memcmp(left->bytes, right->bytes, left->length);
}

/* ---- other inputs */

static uint64_t state = 1;

/* xorshift64* */
static size_t below(size_t limit)
{
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return limit > 0 ? (size_t)((state * 0x2545f4914f6cdd1dull) >> 33) % limit : 0;
}

static void change(struct input *input)
{
    static const uint8_t telling[] = {0, 1, 2, 3, 16, 127, 128, 254, 255};
    const size_t at = below(input->length), room = options.max_length - input->length;
    size_t length = 1u + below(below(4) > 0 ? 4u : 64u);
    switch (below(6)) {
    case 0:
        input->bytes[at] ^= (uint8_t)(1u << below(8));
        break;
    case 1:
        input->bytes[at] = (uint8_t)below(256);
        break;
    case 2:
        input->bytes[at] = telling[below(sizeof telling)];
        break;
    case 3: /* leave some out */
        length = length < input->length - at ? length : input->length - at;
        memmove(&input->bytes[at], &input->bytes[at + length], input->length - at - length);
        input->length -= length;
        break;
    default: /* put some in: any, or some of this or another input */
        length = length < room ? length : room;
        memmove(&input->bytes[at + length], &input->bytes[at], input->length - at);
        const struct input *from = &found[below(kept)];
        const size_t first = below(from->length);
        for (size_t n = 0; n < length; n++) {
            input->bytes[at + n] = first + n < from->length ? from->bytes[first + n]
                                                            : (uint8_t)below(256);
        }
        input->length += length;
    }
}

static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void keep(struct input input)
{
    if (kept < MOST_INPUTS) {
        found[kept++] = input;
    }
    if (options.folder != NULL) {
        write_input(options.folder, "/", input);
    }
}

static void search(void)
{
    uint8_t bytes[LONGEST] = {0};
    const double end_s = now_s() + options.total_s;
    while (now_s() < end_s) {
        /* one of the last as often as one of all: they lead on */
        const size_t from = below(2) && kept > 16u ? kept - 1u - below(16) : below(kept);
        struct input input = {1u, bytes};
        if (kept > 0 && found[from].length > 0) {
            input.length = found[from].length;
            memcpy(bytes, found[from].bytes, input.length);
        }
        for (size_t left = 1u << below(5); left > 0 && input.length > 0; left--) {
            change(&input);
        }
        if (input.length > 0 && reaches_new(input)) {
            keep(copy(input.bytes, input.length));
        }
    }
}

/* ---- */

static void parse(int count, char **words)
{
    struct stat status;
    bool folders = false;
    for (int n = 1; n < count; n++) {
        if (sscanf(words[n], "-max_total_time=%lf", &options.total_s) == 1
            || sscanf(words[n], "-max_len=%zu", &options.max_length) == 1
            || sscanf(words[n], "-seed=%llu", (unsigned long long *)&state) == 1) {
            continue;
        }
        if (strcmp(words[n], "-merge=1") == 0) {
            options.merge = true;
        } else if (strncmp(words[n], "-artifact_prefix=", 17u) == 0) {
            options.prefix = &words[n][17];
        } else if (stat(words[n], &status) == 0 && S_ISDIR(status.st_mode)) {
            options.folder = folders ? options.folder : words[n];
            folders = true;
            read_folder(words[n]);
        } else {
            read_file(words[n]);
        }
    }
    state = state * 0x9e3779b97f4a7c15ull + 1u;
    options.max_length = options.max_length < LONGEST ? options.max_length : LONGEST;
}

static void report(void)
{
    const struct seen *all = &invariants_seen;
    unsigned edges = 0;
    for (size_t n = 0; n < EDGES; n++) {
        edges += seen[n] != 0;
    }
    printf("%lu inputs, %u edges, %u kept; %lu replies, %lu of them exceptions, %lu enabled, "
           "%lu trajectories outside the limits, %lu starts, %lu exchanges of gains on the way to "
           "rest, samples: %lu with effort, %lu in motion, %lu in fault; nothing found\n",
           runs, edges, kept, all->replies, all->exceptions, all->enables,
           all->refused_trajectories, all->starts, all->exchanges, all->samples_with_effort,
           all->samples_in_motion, all->samples_in_fault);
}

int main(int count, char **words)
{
    static const int ends[] = {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGALRM};
    for (size_t n = 0; n < sizeof ends / sizeof ends[0]; n++) {
        signal(ends[n], on_end);
    }
    parse(count, words);
    qsort(inputs, given, sizeof inputs[0], compare);
    const char *folder = options.folder;
    options.folder = options.merge ? folder : NULL; /* what is there already is not written */
    for (unsigned n = 0; n < given; n++) {
        if (reaches_new(inputs[n])) {
            keep(inputs[n]);
        }
    }
    options.folder = folder;
    search();
    report();
    return EXIT_SUCCESS;
}
