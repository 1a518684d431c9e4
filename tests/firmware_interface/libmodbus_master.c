/* A Modbus RTU master made of libmodbus alone. Usage: libmodbus_master DEVICE COMMAND...
 * with commands  read ADDRESS COUNT | write ADDRESS WORD (function 6) | writes ADDRESS WORD...
 * (function 16, last). Prints the words of each read, or the error of what was refused. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <modbus.h>

static int number(const char *word)
{
    return (int)strtol(word, NULL, 0);
}

static void report(int done)
{
    printf("%s\n", done < 0 ? modbus_strerror(errno) : "done");
}

static void read_words(modbus_t *bus, int address, int count)
{
    uint16_t words[MODBUS_MAX_READ_REGISTERS];
    if (modbus_read_registers(bus, address, count, words) < 0) {
        report(-1);
        return;
    }
    for (int n = 0; n < count; n++) {
        printf("%u%c", words[n], n + 1 < count ? ' ' : '\n');
    }
}

int main(int count, char **words)
{
    uint16_t values[MODBUS_MAX_WRITE_REGISTERS];
    modbus_t *bus = count > 1 ? modbus_new_rtu(words[1], 115200, 'N', 8, 1) : NULL;
    if (bus == NULL || modbus_set_slave(bus, 1) != 0 || modbus_connect(bus) != 0) {
        fprintf(stderr, "cannot connect: %s\n", modbus_strerror(errno));
        return EXIT_FAILURE;
    }
    for (int n = 2; n + 2 < count; n += 3) {
        const int address = number(words[n + 1]);
        if (strcmp(words[n], "read") == 0) {
            read_words(bus, address, number(words[n + 2]));
        } else if (strcmp(words[n], "write") == 0) {
            report(modbus_write_register(bus, address, (uint16_t)number(words[n + 2])));
        } else {
            int length = 0;
            for (n += 2; n < count; n++) {
                values[length++] = (uint16_t)number(words[n]);
            }
            report(modbus_write_registers(bus, address, length, values));
        }
    }
    modbus_close(bus);
    modbus_free(bus);
    return EXIT_SUCCESS;
}
