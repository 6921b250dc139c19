/* What models made of tables share: memory, values, and states to come back to. Before it: how many
   INPUTS and VARIABLES there are, a Model whose changing part `now` has the values `given` to the
   inputs, and `output` of the other variables. */

Model *model_open(const char *resources, char *message)
{
    Model *m = malloc(sizeof *m);
    (void)resources;
    if (!m)
        snprintf(message, MESSAGE, "no memory for %zu bytes of the model.", sizeof *m);
    else
        model_reset(m, message);
    return m;
}

void model_close(Model *m) { free(m); }

int model_set(Model *m, size_t n, const unsigned refs[], const double values[], char *message)
{
    for (size_t k = 0; k < n; k++) {
        if (refs[k] >= INPUTS || !isfinite(values[k])) {
            snprintf(message, MESSAGE, refs[k] >= INPUTS
                         ? "value reference %u cannot be set (to %g); inputs are the first %d."
                         : "the input of value reference %u = %g is not a finite number.",
                     refs[k], values[k], INPUTS);
            return ERROR;
        }
        m->now.given[refs[k]] = values[k];
    }
    return OK;
}

int model_get(Model *m, size_t n, const unsigned refs[], double values[], char *message)
{
    for (size_t k = 0; k < n; k++) {
        if (refs[k] >= VARIABLES) {
            snprintf(message, MESSAGE, "no variable has the value reference %u; all are < %d.",
                     refs[k], VARIABLES);
            return ERROR;
        }
        values[k] = refs[k] < INPUTS ? m->now.given[refs[k]] : output(m, refs[k] - INPUTS);
    }
    return OK;
}

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
