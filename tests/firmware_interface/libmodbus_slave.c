/* A Modbus TCP slave made of libmodbus alone, on 127.0.0.1: serves the words (big-endian) of a
 * file from address 0 to one client. Usage: libmodbus_slave FILE PORT */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include <modbus.h>

int main(int count, char **words)
{
    uint8_t request[MODBUS_TCP_MAX_ADU_LENGTH];
    FILE *image = count == 3 ? fopen(words[1], "rb") : NULL;
    modbus_t *bus = count == 3 ? modbus_new_tcp("127.0.0.1", atoi(words[2])) : NULL;
    modbus_mapping_t *map = modbus_mapping_new(0, 0, 0x9000, 0);
    int listening = bus == NULL ? -1 : modbus_tcp_listen(bus, 1);
    if (image == NULL || map == NULL || listening < 0) {
        fprintf(stderr, "cannot serve: %s\n", modbus_strerror(errno));
        return EXIT_FAILURE;
    }
    for (int n = 0, high; n < map->nb_registers && (high = getc(image)) != EOF; n++) {
        map->tab_registers[n] = (uint16_t)(high << 8 | getc(image));
    }
    fclose(image);
    puts("ready");
    fflush(stdout);
    modbus_tcp_accept(bus, &listening);
    for (int length; (length = modbus_receive(bus, request)) >= 0;) {
        modbus_reply(bus, request, length, map);
    }
    close(listening);
    modbus_mapping_free(map);
    modbus_free(bus);
    return EXIT_SUCCESS;
}
