/* The reference firmware on Linux: prints the pseudo-terminal to connect to, then serves until a
 * signal ends it. SIGUSR1 presses the wired emergency stop, SIGUSR2 releases it; the press is
 * latched where it arrives, however soon the release follows. */
#define _XOPEN_SOURCE 700

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../board.h"
#include "port_linux.h"

static volatile sig_atomic_t ended;

static void on_signal(int number)
{
    if (number == SIGUSR1 || number == SIGUSR2) {
        port_linux_press_stop(number == SIGUSR1);
    } else {
        ended = 1;
    }
}

static void catch_signals(void)
{
    static const int numbers[] = {SIGINT, SIGTERM, SIGUSR1, SIGUSR2};
    struct sigaction action = {.sa_handler = on_signal};
    sigfillset(&action.sa_mask); /* else a release could overtake the press that it interrupts */
    for (size_t n = 0; n < sizeof numbers / sizeof numbers[0]; n++) {
        sigaction(numbers[n], &action, NULL);
    }
}

/* Where the number of an option goes; null where it is none. */
static double *number_of(const char *name, struct linux_options *options)
{
    const struct {
        const char *name;
        double *number;
    } known[] = {
        {"--speed", &options->speed},
        {"--confirm-window", &options->confirm_window_s},
        {"--homed", &options->homed},
        {"--switches", &options->switches_rad},
    };
    for (size_t n = 0; n < sizeof known / sizeof known[0]; n++) {
        if (strcmp(name, known[n].name) == 0) {
            return known[n].number;
        }
    }
    return NULL;
}

static int usable(const struct linux_options *options)
{
    return options->speed > 0.0 && options->confirm_window_s > 0.0
        && options->confirm_window_s < 1800.0 && options->homed >= 0.0 && options->homed <= 3.0
        && options->switches_rad >= 0.0;
}

/* Where the text of an option goes; null where it is none. */
static const char **text_of(const char *name, struct linux_options *options)
{
    if (strcmp(name, "--store") == 0) {
        return &options->store;
    }
    return strcmp(name, "--plant") == 0 ? &options->plant : NULL;
}

/* Options come in pairs of name and value. */
static int parse(int count, char **words, struct linux_options *options)
{
    for (int n = 1; n < count; n += 2) {
        double *number = number_of(words[n], options);
        const char **text = text_of(words[n], options);
        char *end;
        if (n + 1 == count) {
            return 0;
        }
        if (text != NULL) {
            *text = words[n + 1];
            continue;
        }
        if (number == NULL) {
            return 0;
        }
        *number = strtod(words[n + 1], &end);
        if (*end != '\0' || end == words[n + 1]) {
            return 0;
        }
    }
    return usable(options);
}

int main(int count, char **words)
{
    struct linux_options options = {.speed = 1.0, .confirm_window_s = 120.0};
    if (!parse(count, words, &options)) {
        fprintf(stderr,
                "usage: %s [--speed FACTOR] [--store FILE] [--confirm-window SECONDS]"
                " [--homed BITS] [--switches RAD] [--plant SOCKET]\n",
                words[0]);
        return 2;
    }
    catch_signals();
    const char *path = port_linux_open(&options);
    if (path == NULL) {
        perror("no pseudo-terminal");
        return EXIT_FAILURE;
    }
    board_power_up();
    if (!port_linux_start(board_sample)) {
        perror("no thread");
        return EXIT_FAILURE;
    }
    puts(path);
    fflush(stdout);
    while (!ended) {
        if (!board_poll()) {
            port_linux_wait();
        }
    }
    port_linux_end();
    return EXIT_SUCCESS;
}
