/* States to come back to, of a Model whose changing part is `now`. Before it: the Model. */

int model_keep(Model *m, void **state, char *message)
{
    *state = malloc(sizeof m->now);
    if (!*state) {
        snprintf(message, MESSAGE, "no memory for a state.");
        return ERROR;
    }
    memcpy(*state, &m->now, sizeof m->now);
    return OK;
}

int model_recall(Model *m, void *state, char *message)
{
    (void)message;
    memcpy(&m->now, state, sizeof m->now);
    return OK;
}

int model_drop(Model *m, void *state, char *message)
{
    (void)m, (void)message;
    free(state);
    return OK;
}
