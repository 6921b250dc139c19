/* What an FMU needs of the model behind it. All functions answer OK or ERROR; ERROR comes with a
   sentence in message, OK with one if the user is to be warned. */
#ifndef MODEL_H
#define MODEL_H

#include <stddef.h>

enum { OK = 0, WARNING = 1, ERROR = 3 }; /* numbers of fmi2Status */
enum { MESSAGE = 2048 };

typedef struct Model Model;

/* resources: folder of the unpacked FMU; NULL when it fails */
Model *model_open(const char *resources, char *message);
void model_close(Model *m);

int model_set(Model *m, size_t n, const unsigned refs[], const double values[], char *message);
int model_get(Model *m, size_t n, const unsigned refs[], double values[], char *message);
/* the state at time t that follows from parameters and inputs */
int model_start(Model *m, double t, char *message);
/* from t to t + h with the inputs as they are */
int model_step(Model *m, double t, double h, char *message);
int model_reset(Model *m, char *message);

/* states to come back to */
int model_keep(Model *m, void **state, char *message);
int model_recall(Model *m, void *state, char *message);
int model_drop(Model *m, void *state, char *message);

#endif
