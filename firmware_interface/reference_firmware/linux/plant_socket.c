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

/* Read the angles of all axes, and nothing else, from the plant's next line. */
static bool read_angles(double shown_rad[FD_AXES])
{
    char line[LINE_BYTES];
    char *rest = line;
    if (fgets(line, sizeof line, from_plant) == NULL) {
        fputs("the plant has ended the connection\n", stderr);
        return false;
    }
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        char *end;
        shown_rad[axis] = strtod(rest, &end);
        if (end == rest || !(fabs(shown_rad[axis]) <= FARTHEST_RAD)) {
            break;
        }
        rest = end;
    }
    if (strcmp(rest, "\n") != 0) {
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
    fprintf(to_plant, "plant %d %.17g %.17g %d\n", VERSION, SAMPLE_PERIOD_NS * 1e-9, delay_s,
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
