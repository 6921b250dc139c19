/* A model that lives in a Python process of its own: "python3 -m rom.fmu <resources>" at the other
   end of a socket. A request is (verb, references, values), an answer (status, values, text); the
   verbs are those of rom/fmu/driven.py. Nothing of Python enters the program that runs the FMU. */
#define _GNU_SOURCE
#include <errno.h>
#include <signal.h>
#include <spawn.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "model.h"

extern char **environ;

enum Verb { SET = 1, GET, START, STEP, KEEP, RECALL, DROP, RESET };

struct Model {
    pid_t pid;
    int socket;
};

static int sent(int socket, const void *data, size_t size)
{
    const char *next = data;
    while (size) {
        ssize_t n = send(socket, next, size, MSG_NOSIGNAL);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return 0;
        next += n, size -= (size_t)n;
    }
    return 1;
}

static int received(int socket, void *data, size_t size)
{
    char *next = data;
    while (size) {
        ssize_t n = recv(socket, next, size, 0);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return 0;
        next += n, size -= (size_t)n;
    }
    return 1;
}

static int lost(char *message)
{
    snprintf(message, MESSAGE, "the Python process of the mechanism has ended.");
    return ERROR;
}

/* The answer must hold n values unless it is an error. */
static int hear(Model *m, size_t n, double values[], char *message)
{
    int32_t head[3]; /* status, number of values, length of the text */
    char byte;
    if (!received(m->socket, head, sizeof head))
        return lost(message);
    if (head[0] == OK && (size_t)head[1] != n) {
        snprintf(message, MESSAGE, "%d values arrived instead of %d.", head[1], (int)n);
        return ERROR;
    }
    if (head[1] && !received(m->socket, values, sizeof(double) * (size_t)head[1]))
        return lost(message);
    for (int32_t k = 0; k < head[2]; k++) {
        if (!received(m->socket, &byte, 1))
            return lost(message);
        if (k < MESSAGE - 1)
            message[k] = byte, message[k + 1] = 0;
    }
    return head[0];
}

static int ask(Model *m, enum Verb verb, size_t n, const unsigned refs[], size_t n_in,
               const double in[], size_t n_out, double out[], char *message)
{
    int32_t head[3] = {verb, (int32_t)n, (int32_t)n_in};
    if (!sent(m->socket, head, sizeof head) || !sent(m->socket, refs, sizeof *refs * n) ||
        !sent(m->socket, in, sizeof *in * n_in))
        return lost(message);
    return hear(m, n_out, out, message);
}

/* 0 or what went wrong, as errno */
static int begin(Model *m, const char *python, const char *resources)
{
    char *arguments[] = {(char *)python, "-P", "-m", "rom.fmu", (char *)resources, NULL};
    posix_spawn_file_actions_t actions;
    int ends[2], failure;
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends))
        return errno;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], 0);
    failure = posix_spawnp(&m->pid, python, &actions, NULL, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    m->socket = ends[0];
    if (failure)
        close(ends[0]);
    return failure;
}

/* The interpreter that wrote the FMU, where it can be run; as the first line of a resource. */
static const char *writer(const char *resources, char *path)
{
    FILE *file;
    snprintf(path, MESSAGE, "%s/python", resources);
    file = fopen(path, "r");
    if (!file)
        return NULL;
    if (!fgets(path, MESSAGE, file))
        path[0] = 0;
    fclose(file);
    path[strcspn(path, "\n")] = 0;
    return access(path, X_OK) ? NULL : path;
}

Model *model_open(const char *resources, char *message)
{
    char path[MESSAGE];
    const char *python = getenv("ROM_PYTHON");
    if (!python || !*python)
        python = writer(resources, path);
    if (!python)
        python = "python3";
    Model *m = malloc(sizeof *m);
    int failure = m ? begin(m, python, resources) : ENOMEM;
    if (failure) {
        snprintf(message, MESSAGE, "%s cannot be started: %s. Set ROM_PYTHON to a Python that has "
                 "rom.", python, strerror(failure));
        free(m);
        return NULL;
    }
    message[0] = 0;
    if (hear(m, 0, NULL, message) == OK)
        return m;
    model_close(m);
    if (!strncmp(message, "the Python process", 18))
        snprintf(message, MESSAGE, "%s ended at once. Set ROM_PYTHON to a Python that has rom.",
                 python);
    return NULL;
}

void model_close(Model *m)
{
    close(m->socket); /* at which the process ends */
    while (waitpid(m->pid, NULL, 0) < 0 && errno == EINTR)
        ;
    free(m);
}

int model_set(Model *m, size_t n, const unsigned refs[], const double values[], char *message)
{
    return ask(m, SET, n, refs, n, values, 0, NULL, message);
}

int model_get(Model *m, size_t n, const unsigned refs[], double values[], char *message)
{
    return ask(m, GET, n, refs, 0, NULL, n, values, message);
}

int model_start(Model *m, double t, char *message)
{
    return ask(m, START, 0, NULL, 1, &t, 0, NULL, message);
}

int model_step(Model *m, double t, double h, char *message)
{
    double times[2] = {t, h};
    return ask(m, STEP, 0, NULL, 2, times, 0, NULL, message);
}

int model_reset(Model *m, char *message)
{
    return ask(m, RESET, 0, NULL, 0, NULL, 0, NULL, message);
}

/* States stay in the process; here they are numbers from 1. */
int model_keep(Model *m, void **state, char *message)
{
    double number = 0.0;
    int status = ask(m, KEEP, 0, NULL, 0, NULL, 1, &number, message);
    *state = (void *)(intptr_t)number;
    return status;
}

static int about(Model *m, enum Verb verb, void *state, char *message)
{
    double number = (double)(intptr_t)state;
    return ask(m, verb, 0, NULL, 1, &number, 0, NULL, message);
}

int model_recall(Model *m, void *state, char *message) { return about(m, RECALL, state, message); }
int model_drop(Model *m, void *state, char *message) { return about(m, DROP, state, message); }
