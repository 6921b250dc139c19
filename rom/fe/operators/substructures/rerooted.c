/* An elimination order with given unknowns last, without more fill than the order it comes from.

   The graph with its fill is chordal. Maximum cardinality search, which numbers from the end the
   vertex that has most numbered neighbours, gives an order without further fill of such a graph from
   any clique on (Tarjan and Yannakakis, SIAM J. Comput. 13 (1984) 566). */

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    int64_t *start;
    int32_t *neighbour;
} graph;

static int32_t *grown(int32_t *old, int64_t *room, int64_t need)
{
    if (need <= *room)
        return old;
    *room = 2 * need;
    int32_t *larger = realloc(old, *room * sizeof *larger);
    if (!larger)
        free(old);
    return larger;
}

/* Columns of the factor: of the matrix, and of the columns whose first entry is in this row. */
static int symbolic(int32_t n, const int64_t *start, const int32_t *neighbour, const int32_t *order,
                    graph *L)
{
    int64_t room = 4 * (start[n] + 1), size = 0;
    int32_t *place = malloc(n * sizeof *place), *mark = malloc(n * sizeof *mark);
    int32_t *child = malloc(n * sizeof *child), *next = malloc(n * sizeof *next);
    L->start = malloc((n + 1) * sizeof *L->start);
    L->neighbour = malloc(room * sizeof *L->neighbour);
    int ok = place && mark && child && next && L->start && L->neighbour;
    for (int32_t j = 0; ok && j < n; j++) {
        place[order[j]] = j;
        mark[j] = child[j] = -1;
    }
    for (int32_t j = 0; ok && j < n; j++) {
        int32_t v = order[j], parent = n;
        int64_t need = size + start[v + 1] - start[v];
        for (int32_t c = child[j]; c >= 0; c = next[c])
            need += L->start[c + 1] - L->start[c];
        L->neighbour = grown(L->neighbour, &room, need);
        ok = L->neighbour != NULL;
        L->start[j] = size;
        mark[j] = j;
        for (int64_t t = start[v]; ok && t < start[v + 1]; t++) {
            int32_t i = place[neighbour[t]];
            if (i > j && mark[i] != j) {
                mark[i] = j;
                L->neighbour[size++] = i;
            }
        }
        for (int32_t c = child[j]; ok && c >= 0; c = next[c])
            for (int64_t t = L->start[c]; t < L->start[c + 1]; t++) {
                int32_t i = L->neighbour[t];
                if (i > j && mark[i] != j) {
                    mark[i] = j;
                    L->neighbour[size++] = i;
                }
            }
        for (int64_t t = L->start[j]; ok && t < size; t++)
            if (L->neighbour[t] < parent)
                parent = L->neighbour[t];
        if (ok && parent < n) {
            next[j] = child[parent];
            child[parent] = j;
        }
        L->start[j + 1] = size;
    }
    free(place), free(mark), free(child), free(next);
    return ok;
}

static int both_ways(int32_t n, const graph *L, graph *G)
{
    int64_t *filled = malloc((n + 1) * sizeof *filled);
    G->start = calloc(n + 1, sizeof *G->start);
    G->neighbour = malloc((2 * L->start[n] + 1) * sizeof *G->neighbour);
    int ok = filled && G->start && G->neighbour;
    if (ok) {
        for (int32_t j = 0; j < n; j++)
            for (int64_t t = L->start[j]; t < L->start[j + 1]; t++)
                G->start[j + 1]++, G->start[L->neighbour[t] + 1]++;
        for (int32_t j = 0; j < n; j++)
            G->start[j + 1] += G->start[j];
        memcpy(filled, G->start, (n + 1) * sizeof *filled);
        for (int32_t j = 0; j < n; j++)
            for (int64_t t = L->start[j]; t < L->start[j + 1]; t++) {
                int32_t i = L->neighbour[t];
                G->neighbour[filled[j]++] = i;
                G->neighbour[filled[i]++] = j;
            }
    }
    free(filled);
    return ok;
}

/* Vertices in lists by the number of their numbered neighbours. */
typedef struct {
    int32_t *count, *first, *next, *previous;
} lists;

static void take(lists *s, int32_t v)
{
    if (s->previous[v] >= 0)
        s->next[s->previous[v]] = s->next[v];
    else
        s->first[s->count[v]] = s->next[v];
    if (s->next[v] >= 0)
        s->previous[s->next[v]] = s->previous[v];
}

static void put(lists *s, int32_t v)
{
    int32_t head = s->first[s->count[v]];
    s->previous[v] = -1;
    s->next[v] = head;
    if (head >= 0)
        s->previous[head] = v;
    s->first[s->count[v]] = v;
}

/* From the end: the wanted vertices, then the others by maximum cardinality. */
static int searched(int32_t n, const graph *G, int32_t n_last, const int32_t *last, int32_t *found)
{
    lists s = {calloc(n, sizeof(int32_t)), malloc((n + 1) * sizeof(int32_t)),
               malloc(n * sizeof(int32_t)), malloc(n * sizeof(int32_t))};
    char *numbered = calloc(n, 1);
    int ok = s.count && s.first && s.next && s.previous && numbered;
    int32_t top = 0;
    for (int32_t k = 0; ok && k <= n; k++)
        s.first[k] = -1;
    for (int32_t v = n - 1; ok && v >= 0; v--)
        put(&s, v);
    for (int32_t k = 0; ok && k < n; k++) {
        while (s.first[top] < 0 && top > 0)
            top--;
        int32_t v = k < n_last ? last[n_last - 1 - k] : s.first[top];
        take(&s, v);
        numbered[v] = 1;
        found[n - 1 - k] = v;
        for (int64_t t = G->start[v]; t < G->start[v + 1]; t++) {
            int32_t u = G->neighbour[t];
            if (numbered[u])
                continue;
            take(&s, u);
            if (++s.count[u] > top)
                top = s.count[u];
            put(&s, u);
        }
    }
    free(s.count), free(s.first), free(s.next), free(s.previous), free(numbered);
    return ok;
}

/* order (n), in place: vertices in the order in which they are eliminated, the last n_last vertices
   of the graph, which are a clique, at its end. Entries of the factor; -1 without memory. */
int64_t rerooted(int32_t n, const int64_t *start, const int32_t *neighbour, int32_t n_last,
                 int32_t *order)
{
    graph L = {0}, G = {0};
    int32_t *last = malloc((n_last + 1) * sizeof *last), *found = malloc((n + 1) * sizeof *found);
    int64_t entries = -1;
    if (last && found && symbolic(n, start, neighbour, order, &L) && both_ways(n, &L, &G)) {
        for (int32_t j = 0; j < n; j++)
            if (order[j] >= n - n_last)
                last[order[j] - (n - n_last)] = j;
        if (searched(n, &G, n_last, last, found)) {
            entries = L.start[n];
            for (int32_t j = 0; j < n; j++)
                found[j] = order[found[j]];
            memcpy(order, found, n * sizeof *order);
        }
    }
    free(last), free(found);
    free(L.start), free(L.neighbour), free(G.start), free(G.neighbour);
    return entries;
}
