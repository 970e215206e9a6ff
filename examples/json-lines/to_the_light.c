/* A robot that drives towards the light: a line of JSON in, a line out.
 *
 * It reads two numbers of each line, and needs no library for that. One that reads more should use one.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double SPEED_M_PER_S = 0.1;

/* Finds the value of a key in a line, the first one of that name. */
static const char *value_of(const char *line, const char *key)
{
    const char *found = strstr(line, key);
    return found ? found + strlen(key) : NULL;
}

int main(void)
{
    char *line = NULL;
    size_t room = 0;
    while (getline(&line, &room, stdin) > 0) {
        const char *tick = value_of(line, "\"tick\":");
        const char *light = value_of(line, "\"light\":");
        const char *bearing = light ? value_of(light, "\"bearing_rad\":") : NULL;
        if (!tick || !bearing) {
            /* The first line of a life says who this is. */
            puts("{}");
        } else if (strncmp(bearing, "null", 4) == 0) {
            printf("{\"tick\":%lld}\n", atoll(tick));
        } else {
            double angle = strtod(bearing, NULL);
            printf("{\"tick\":%lld,\"velocity\":[%.17g,%.17g]}\n", atoll(tick), SPEED_M_PER_S * cos(angle),
                   SPEED_M_PER_S * sin(angle));
        }
        fflush(stdout);
    }
    free(line);
    return 0;
}
