/* The reference firmware on Linux: prints the pseudo-terminal to connect to, then serves until a
 * signal ends it. SIGUSR1 presses the wired emergency stop, SIGUSR2 releases it. */
#define _XOPEN_SOURCE 700

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../board.h"
#include "port_linux.h"

static volatile sig_atomic_t ended, stop_pressed;

static void on_signal(int number)
{
    if (number == SIGUSR1 || number == SIGUSR2) {
        stop_pressed = number == SIGUSR1;
    } else {
        ended = 1;
    }
}

static void catch_signals(void)
{
    static const int numbers[] = {SIGINT, SIGTERM, SIGUSR1, SIGUSR2};
    struct sigaction action = {.sa_handler = on_signal};
    for (size_t n = 0; n < sizeof numbers / sizeof numbers[0]; n++) {
        sigaction(numbers[n], &action, NULL);
    }
}

/* Options come in pairs of name and value. */
static int parse(int count, char **words, struct linux_options *options)
{
    for (int n = 1; n < count; n += 2) {
        char *end = n + 1 < count ? words[n + 1] : NULL;
        if (end == NULL) {
            return 0;
        } else if (strcmp(words[n], "--speed") == 0) {
            options->speed = strtod(words[n + 1], &end);
        } else if (strcmp(words[n], "--confirm-window") == 0) {
            options->confirm_window_s = strtod(words[n + 1], &end);
        } else if (strcmp(words[n], "--store") == 0) {
            options->store = words[n + 1];
            continue;
        } else {
            return 0;
        }
        if (*end != '\0' || end == words[n + 1]) {
            return 0;
        }
    }
    return options->speed > 0.0 && options->confirm_window_s > 0.0
        && options->confirm_window_s < 2000.0;
}

int main(int count, char **words)
{
    struct linux_options options = {.speed = 1.0, .confirm_window_s = 120.0};
    if (!parse(count, words, &options)) {
        fprintf(stderr,
                "usage: %s [--speed FACTOR] [--store FILE] [--confirm-window SECONDS]\n", words[0]);
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
        port_linux_press_stop(stop_pressed);
        port_linux_wait();
        board_poll();
    }
    port_linux_end();
    return EXIT_SUCCESS;
}
