#define _XOPEN_SOURCE 700

#include "plant_socket.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>

#define VERSION 1
#define LINE_BYTES 256
#define FARTHEST_RAD 1e6 /* what a counter of 32 bits can show */

static FILE *to_plant, *from_plant;

/* The angles of all axes, and nothing else. */
static bool parse_angles(const char *text, double shown_rad[FD_AXES])
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        char *end;
        shown_rad[axis] = strtod(text, &end);
        if (end == text || !(fabs(shown_rad[axis]) <= FARTHEST_RAD)) {
            return false;
        }
        text = end;
    }
    return strcmp(text, "\n") == 0;
}

static bool read_angles(double shown_rad[FD_AXES])
{
    char line[LINE_BYTES];
    if (fgets(line, sizeof line, from_plant) == NULL) {
        fputs("the plant has ended the connection\n", stderr);
        return false;
    }
    if (!parse_angles(line, shown_rad)) {
        fprintf(stderr, "the plant answers: %s", line);
        return false;
    }
    return true;
}

static bool connect_to(const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    const int number = socket(AF_UNIX, SOCK_STREAM, 0);
    if (number < 0 || strlen(path) >= sizeof address.sun_path) {
        fprintf(stderr, "%s: no path of a socket\n", path);
        return false;
    }
    strcpy(address.sun_path, path);
    if (connect(number, (const struct sockaddr *)&address, sizeof address) != 0) {
        perror(path);
        return false;
    }
    to_plant = fdopen(number, "w");
    from_plant = fdopen(number, "r");
    return to_plant != NULL && from_plant != NULL;
}

bool plant_socket_open(const char *path, double delay_s, double shown_rad[FD_AXES])
{
    signal(SIGPIPE, SIG_IGN); /* a plant that is gone shows in what it answers */
    if (!connect_to(path)) {
        return false;
    }
    fprintf(to_plant, "plant %d %.15g %.15g %d\n", VERSION, SAMPLE_PERIOD_NS * 1e-9, delay_s,
            FD_AXES);
    fflush(to_plant);
    return read_angles(shown_rad);
}

bool plant_socket_advance(const double effort_nm[FD_AXES], double shown_rad[FD_AXES])
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        fprintf(to_plant, "%s%.17g", axis > 0 ? " " : "", effort_nm[axis]);
    }
    fputc('\n', to_plant);
    fflush(to_plant);
    return read_angles(shown_rad);
}
