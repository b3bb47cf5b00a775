/* The C interface from C17: every function with valid calls, wrong calls, closed handles, threads and fork(). Prints
 * lines as GoogleTest does, because tools/test counts them. The version script and the header are tested by linking this
 * program against the shared library alone. */
#include "filiform.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static int failures = 0;
static char folder[256], set_path[300], swc_path[300];

#define CHECK(condition)                                                                                     \
  do {                                                                                                       \
    if (!(condition)) {                                                                                      \
      printf("%s:%d: not true: %s (last error: %s)\n", __FILE__, __LINE__, #condition, filiform_error_text()); \
      ++failures;                                                                                            \
    }                                                                                                        \
  } while (0)
#define OK(call) CHECK((call) == FILIFORM_OK)
#define FAILS(status, text, call)                            \
  do {                                                       \
    CHECK((call) == (status));                               \
    CHECK(strstr(filiform_error_text(), (text)) != NULL);    \
    CHECK(strchr(filiform_error_text(), '\n') == NULL);      \
  } while (0)

/* A Y: the soma 1, a dendrite with a fork at 3, tips 5 and 7. Lengths: 1-2 10, 2-3 10, 3-4-5 and 3-6-7. */
static const char *const kCell =
    "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 20 0 0 1 2\n4 3 30 0 0 1 3\n5 3 40 0 0 1 4\n6 4 20 10 0 2 3\n7 4 20 30 0 2 6\n";

static void write_file(const char *path, const char *text) {
  FILE *file = fopen(path, "w");
  if (file == NULL) abort();
  fputs(text, file);
  fclose(file);
}

static filiform_set *opened(void) {
  filiform_set *set = NULL;
  OK(filiform_open(set_path, NULL, &set));
  return set;
}

static filiform_cell *cell_of(filiform_set *set) {
  filiform_cell *cell = NULL;
  OK(filiform_cell_open(set, 0, &cell));
  return cell;
}

static filiform_place place_of(filiform_cell *cell, int64_t sample) {
  filiform_place place;
  OK(filiform_cell_place(cell, sample, &place));
  return place;
}

static int near_to(double value, double expected) { return fabs(value - expected) < 1e-9; }

/* ---- ingest */

struct counted {
  int calls, stop_at;
};

static int count_progress(void *user, const char *phase, uint64_t done, uint64_t total) {
  struct counted *counted = user;
  CHECK(phase != NULL && phase[0] != '\0' && (total == 0 || done <= total));
  return ++counted->calls == counted->stop_at;
}

static void ingest_makes_a_set(void) {
  const char *inputs[] = {swc_path};
  struct counted counted = {0, -1};
  filiform_ingest_options options = FILIFORM_INIT(options);
  filiform_ingest_result result = FILIFORM_INIT(result);
  options.progress = count_progress;
  options.user = &counted;
  options.threads = 1;
  options.capacity = 2;
  OK(filiform_ingest(inputs, 1, set_path, &options, &result));
  CHECK(counted.calls > 0);
  CHECK(result.cells == 1 && result.samples == 7 && result.segments == 6 && result.accepted == 1);
  CHECK(result.tiles > 1 && result.bytes > 0 && result.refused == 0);
  FAILS(FILIFORM_INPUT, "already", filiform_ingest(inputs, 1, set_path, &options, &result));
  options.force = 1;
  OK(filiform_ingest(inputs, 1, set_path, &options, NULL));
}

static void ingest_stops_when_the_callback_asks(void) {
  char other[400];
  snprintf(other, sizeof other, "%s/stopped.fil", folder);
  const char *inputs[] = {swc_path};
  struct counted counted = {0, 1};
  filiform_ingest_options options = FILIFORM_INIT(options);
  options.progress = count_progress;
  options.user = &counted;
  FAILS(FILIFORM_INTERRUPTED, "callback", filiform_ingest(inputs, 1, other, &options, NULL));
  CHECK(counted.calls == 1);
  filiform_set *set = NULL;
  FAILS(FILIFORM_IO, "stopped.fil", filiform_open(other, NULL, &set));
}

static void ingest_refuses_wrong_arguments(void) {
  const char *inputs[] = {"/nowhere/x.swc", NULL};
  filiform_ingest_options options = FILIFORM_INIT(options);
  FAILS(FILIFORM_USAGE, "output", filiform_ingest(inputs, 1, NULL, NULL, NULL));
  FAILS(FILIFORM_USAGE, "inputs", filiform_ingest(NULL, 1, "x", NULL, NULL));
  FAILS(FILIFORM_USAGE, "inputs", filiform_ingest(inputs + 1, 1, "x", NULL, NULL));
  FAILS(FILIFORM_USAGE, "count", filiform_ingest(inputs, 0, "x", NULL, NULL));
  FAILS(FILIFORM_USAGE, "address", filiform_ingest(inputs, 1, "http://host/x.fil", NULL, NULL));
  FAILS(FILIFORM_IO, "/nowhere/x.swc", filiform_ingest(inputs, 1, "x", NULL, NULL));
  options.unit = "parsec";
  FAILS(FILIFORM_USAGE, "parsec", filiform_ingest(inputs, 1, "x", &options, NULL));
  options.unit = NULL;
  options.memory_bytes = 1;
  FAILS(FILIFORM_USAGE, "64 MiB", filiform_ingest(inputs, 1, "x", &options, NULL));
  options.memory_bytes = 0;
  options.remove_gone = 1; /* messages name the fields of this interface */
  FAILS(FILIFORM_USAGE, "remove_gone belongs to sync", filiform_ingest(inputs, 1, "x", &options, NULL));
  options.sync = options.add = 1;
  FAILS(FILIFORM_USAGE, "leave out add", filiform_ingest(inputs, 1, "x", &options, NULL));
  CHECK(strstr(filiform_error_text(), "add and") == NULL);
  options.sync = options.remove_gone = 0;
  options.force = 1;
  FAILS(FILIFORM_USAGE, "leave it out with add and sync", filiform_ingest(inputs, 1, "x", &options, NULL));
  options.struct_size = 4;
  FAILS(FILIFORM_USAGE, "struct_size", filiform_ingest(inputs, 1, "x", &options, NULL));
}

/* ---- attributes, measures, filters, counts, levels */

static filiform_set *with_attributes(void) {
  static char path[400], table[400], second[400];
  snprintf(path, sizeof path, "%s/attributes.fil", folder);
  snprintf(table, sizeof table, "%s/table.csv", folder);
  snprintf(second, sizeof second, "%s/second.swc", folder);
  write_file(table, "name,layer,mtype,big\ncell,5,L5_TPC,1152921504606846977\nsecond,4,,2\n");
  write_file(second, "1 1 0 0 100 5 -1\n2 2 0 50 100 1 1\n");
  const char *inputs[] = {swc_path, second};
  filiform_ingest_options options = FILIFORM_INIT(options);
  options.attributes = table;
  options.key = "name";
  options.force = 1;
  OK(filiform_ingest(inputs, 2, path, &options, NULL));
  filiform_set *set = NULL;
  OK(filiform_open(path, NULL, &set));
  return set;
}

static void attributes_and_where(void) {
  filiform_set *set = with_attributes();
  filiform_attribute *attributes = NULL;
  size_t count = 0;
  OK(filiform_attributes(set, &attributes, &count));
  CHECK(count == 3 && strcmp(attributes[0].name, "big") == 0 && attributes[0].type == FILIFORM_INTEGER);
  CHECK(strcmp(attributes[1].name, "layer") == 0 && attributes[1].values == 2);
  CHECK(strcmp(attributes[2].name, "mtype") == 0 && attributes[2].type == FILIFORM_TEXT && attributes[2].values == 1);
  filiform_free(attributes);
  double layers[2] = {0, 0};
  OK(filiform_attribute_numbers(set, "layer", layers));
  CHECK(layers[0] == 5 && layers[1] == 4);
  FAILS(FILIFORM_USAGE, "has texts", filiform_attribute_numbers(set, "mtype", layers));
  FAILS(FILIFORM_USAGE, "no cell has an attribute 'etype'", filiform_attribute_numbers(set, "etype", layers));
  const char **texts = NULL;
  OK(filiform_attribute_texts(set, "mtype", &texts, &count));
  CHECK(count == 2 && strcmp(texts[0], "L5_TPC") == 0 && texts[1] == NULL);
  filiform_free(texts);
  OK(filiform_attribute_texts(set, "big", &texts, &count));
  CHECK(strcmp(texts[0], "1152921504606846977") == 0);
  filiform_free(texts);

  const char *conditions[] = {"layer>=5", "measure:length>50"};
  uint32_t *cells = NULL;
  OK(filiform_where(set, conditions, 2, &cells, &count));
  CHECK(count == 1 && cells[0] == 0);
  filiform_free(cells);
  OK(filiform_where(set, NULL, 0, &cells, &count));
  CHECK(count == 2);
  filiform_free(cells);
  const char *wrong[] = {"measure:lenght>5"};
  FAILS(FILIFORM_USAGE, "length", filiform_where(set, wrong, 1, &cells, &count));
  CHECK(cells == NULL && count == 0);
  OK(filiform_close(set));
}

static void measures(void) {
  filiform_set *set = with_attributes();
  double *values = NULL;
  size_t rows = 0, columns = 0;
  OK(filiform_measure(set, NULL, 0, "length,tips", &values, &rows, &columns));
  CHECK(rows == 2 && columns == 2 && near_to(values[0], 60) && values[1] == 2);
  filiform_free(values);
  const uint32_t second[] = {1}, none[] = {7};
  OK(filiform_measure(set, second, 1, "tips", &values, &rows, &columns));
  CHECK(rows == 1 && columns == 1 && values[0] == 1);
  filiform_free(values);
  const uint32_t twice[] = {1, 0, 1};
  OK(filiform_measure(set, twice, 3, "length,tips", &values, &rows, &columns));
  CHECK(rows == 3 && columns == 2 && values[1] == 1 && values[3] == 2 && values[5] == 1);
  CHECK(values[0] == values[4] && near_to(values[2], 60));
  filiform_free(values);
  FAILS(FILIFORM_USAGE, "cells 0 to 1", filiform_measure(set, none, 1, "tips", &values, &rows, &columns));
  FAILS(FILIFORM_USAGE, "did you mean", filiform_measure(set, NULL, 0, "lenght", &values, &rows, &columns));
  OK(filiform_close(set));
}

static void filters_counts_and_levels(void) {
  filiform_set *set = with_attributes(), *axons = NULL, *layer5 = NULL;
  const uint16_t axon = 2;
  const char *conditions[] = {"layer=5"};
  filiform_filter by_type = FILIFORM_INIT(by_type), by_layer = FILIFORM_INIT(by_layer);
  by_type.types = &axon;
  by_type.type_count = 1;
  by_layer.where = conditions;
  by_layer.where_count = 1;
  OK(filiform_open_filtered(set, &by_type, &axons));
  OK(filiform_open_filtered(set, &by_layer, &layer5));
  const double lo[] = {-1e3, -1e3, -1e3}, hi[] = {1e3, 1e3, 1e3}, half[] = {25, 1e3, 1e3};
  filiform_cell_count *counts = NULL;
  size_t count = 0;
  OK(filiform_box_counts(set, lo, hi, 0, &counts, &count));
  CHECK(count == 2 && counts[0].cell == 0 && counts[0].segments == 6 && counts[1].segments == 1);
  filiform_free(counts);
  OK(filiform_box_counts(axons, lo, hi, 0, &counts, &count));
  CHECK(count == 1 && counts[0].cell == 1);
  filiform_free(counts);
  OK(filiform_box_counts(layer5, lo, half, 1, &counts, &count));
  CHECK(count == 1 && counts[0].segments == 4); /* 3-4, with its middle at x 25, lies above */
  filiform_free(counts);
  const double point[] = {0, 0, 90};
  filiform_hit hit;
  OK(filiform_close(set)); /* views stay */
  OK(filiform_nearest(layer5, point, NULL, &hit, &count));
  CHECK(count == 1 && hit.cell == 0);
  OK(filiform_nearest(axons, point, NULL, &hit, &count));
  CHECK(count == 1 && hit.cell == 1);
  filiform_level_segment *segments = NULL;
  double error_um = -1;
  OK(filiform_levels(axons, lo, hi, 1000, 0, &segments, &count, &error_um));
  CHECK(count > 0 && error_um >= 0 && isfinite(segments[0].child_um[0]));
  filiform_free(segments);
  FAILS(FILIFORM_USAGE, "pixels", filiform_levels(axons, lo, hi, 0, 0, &segments, &count, NULL));
  by_type.struct_size = 3;
  FAILS(FILIFORM_USAGE, "struct_size", filiform_open_filtered(axons, &by_type, &set));
  OK(filiform_close(axons));
  OK(filiform_close(layer5));
}

static size_t cells_in(filiform_set *set) {
  const double lo[] = {-1e3, -1e3, -1e3}, hi[] = {1e3, 1e3, 1e3};
  filiform_cell_count *counts = NULL;
  size_t count = 9;
  OK(filiform_box_counts(set, lo, hi, 0, &counts, &count));
  filiform_free(counts);
  return count;
}

static void a_view_of_a_view_has_what_both_leave(void) {
  filiform_set *set = with_attributes(), *axons = NULL, *view = NULL;
  const uint16_t axon = 2, apical = 4;
  const uint32_t first = 0, second = 1;
  filiform_filter by_axon = FILIFORM_INIT(by_axon), by_apical = FILIFORM_INIT(by_apical);
  filiform_filter by_first = FILIFORM_INIT(by_first), by_second = FILIFORM_INIT(by_second);
  by_axon.types = &axon;
  by_apical.types = &apical;
  by_axon.type_count = by_apical.type_count = 1;
  by_first.cells = &first;
  by_second.cells = &second;
  by_first.cell_count = by_second.cell_count = 1;
  OK(filiform_open_filtered(set, &by_axon, &axons));
  CHECK(cells_in(axons) == 1);
  const struct {
    const filiform_filter *filter;
    size_t cells;
  } cases[] = {{&by_first, 0}, {&by_second, 1}, {&by_axon, 1}, {&by_apical, 0}};
  for (size_t i = 0; i < 4; ++i) {
    OK(filiform_open_filtered(axons, cases[i].filter, &view));
    CHECK(cells_in(view) == cases[i].cells);
    OK(filiform_close(view));
  }
  OK(filiform_open_filtered(set, &by_first, &view));
  filiform_set *both = NULL;
  OK(filiform_open_filtered(view, &by_second, &both));
  CHECK(cells_in(both) == 0);
  OK(filiform_close(both));
  OK(filiform_close(view));
  by_axon.type_count = 0;
  by_first.cell_count = 0;
  OK(filiform_open_filtered(set, &by_axon, &view));
  CHECK(cells_in(view) == 0);
  OK(filiform_close(view));
  OK(filiform_open_filtered(set, &by_first, &view));
  CHECK(cells_in(view) == 0);
  OK(filiform_close(view));
  OK(filiform_close(axons));
  OK(filiform_close(set));
}

/* A program that was compiled with the header of 0.1 gives the smaller struct. */
static void an_older_struct_is_taken(void) {
  const char *inputs[] = {swc_path};
  char other[400];
  snprintf(other, sizeof other, "%s/older.fil", folder);
  filiform_ingest_options options;
  memset(&options, 0xFF, sizeof options);
  memset(&options, 0, offsetof(filiform_ingest_options, attributes));
  options.struct_size = (uint32_t)offsetof(filiform_ingest_options, attributes);
  OK(filiform_ingest(inputs, 1, other, &options, NULL));
  options.struct_size += 4;
  FAILS(FILIFORM_USAGE, "struct_size", filiform_ingest(inputs, 1, other, &options, NULL));
}

/* ---- sets and cells */

static void info_states_counts_and_box(void) {
  filiform_set *set = opened();
  filiform_info info = FILIFORM_INIT(info);
  OK(filiform_get_info(set, &info));
  CHECK(info.cells == 1 && info.cell_ids == 1 && info.samples == 7 && info.segments == 6 && info.roots == 1);
  CHECK(info.lo_um[0] == 0 && info.hi_um[0] == 40 && info.hi_um[1] == 30 && info.capacity == 2);
  CHECK(info.smallest_budget_bytes > 0 && info.bytes > 0 && info.quantum_um > 0);
  info.struct_size += 8;
  FAILS(FILIFORM_USAGE, "struct_size", filiform_get_info(set, &info));
  FAILS(FILIFORM_USAGE, "info: is NULL", filiform_get_info(set, NULL));
  OK(filiform_close(set));
}

static void cells_have_names(void) {
  filiform_set *set = opened();
  filiform_cell_info info = FILIFORM_INIT(info);
  OK(filiform_get_cell_info(set, 0, &info));
  CHECK(strcmp(info.name, "cell") == 0 && info.samples == 7 && !info.has_loops && !info.removed);
  uint32_t id = 5, *ids = NULL;
  size_t count = 0;
  OK(filiform_find_cell(set, "cell", &id));
  CHECK(id == 0);
  FAILS(FILIFORM_USAGE, "axon", filiform_find_cell(set, "axon", &id));
  OK(filiform_cells(set, "C*", &ids, &count)); /* in any letter case */
  CHECK(count == 1 && ids[0] == 0);
  filiform_free(ids);
  static char long_name[60001];
  memset(long_name, 'x', sizeof long_name - 1);
  FAILS(FILIFORM_USAGE, "xxx", filiform_find_cell(set, long_name, &id));
  CHECK(strlen(filiform_error_text()) < 400);
  OK(filiform_cells(set, "x*", &ids, &count));
  CHECK(count == 0 && ids == NULL);
  OK(filiform_cells(set, NULL, &ids, &count));
  CHECK(count == 1);
  filiform_free(ids);
  FAILS(FILIFORM_USAGE, "cell 1", filiform_get_cell_info(set, 1, &info));
  OK(filiform_close(set));
}

static void a_cell_is_arrays(void) {
  filiform_set *set = opened();
  filiform_cell *cell = cell_of(set);
  OK(filiform_close(set)); /* the cell stays */
  filiform_cell_arrays arrays = FILIFORM_INIT(arrays);
  OK(filiform_cell_get_arrays(cell, &arrays));
  CHECK(arrays.samples == 7 && arrays.links == 6);
  CHECK(arrays.points_um[3] == 10 && arrays.radii_um[0] == 5 && arrays.types[5] == 4 && arrays.sample_ids[6] == 7);
  CHECK(arrays.parents[0] == FILIFORM_NONE && arrays.parents[5] == 2);
  CHECK(arrays.ends[0] == 1 && arrays.ends[1] == 0);
  OK(filiform_cell_close(cell));
}

static void paths_follow_the_cell(void) {
  filiform_set *set = opened();
  filiform_cell *cell = cell_of(set);
  const filiform_place root = place_of(cell, 1), a = place_of(cell, 5), b = place_of(cell, 7);
  double length_um = 0, lengths_um[7];
  OK(filiform_cell_distance(cell, a, b, &length_um));
  CHECK(near_to(length_um, 50));
  OK(filiform_cell_distances(cell, root, lengths_um));
  CHECK(near_to(lengths_um[4], 40) && near_to(lengths_um[6], 50));
  filiform_place tip;
  uint32_t rank = 0;
  OK(filiform_cell_farthest_tip(cell, root, &tip, &rank, &length_um));
  CHECK(rank == 6 && near_to(length_um, 50));
  OK(filiform_cell_farthest_tip(cell, root, &tip, NULL, NULL));
  filiform_path_point *points = NULL;
  size_t count = 0;
  filiform_place between = a;
  between.t = 0.5;
  OK(filiform_cell_path(cell, between, b, &points, &count));
  CHECK(count == 5 && points[0].rank == FILIFORM_NONE && near_to(points[0].point_um[0], 35));
  CHECK(points[4].sample_id == 7 && near_to(points[4].along_um, 45));
  filiform_free(points);
  between.t = 2;
  FAILS(FILIFORM_USAGE, "from", filiform_cell_path(cell, between, b, &points, &count));
  CHECK(points == NULL && count == 0);
  between.t = NAN;
  FAILS(FILIFORM_USAGE, "to:", filiform_cell_distance(cell, a, between, &length_um));
  FAILS(FILIFORM_USAGE, "from:", filiform_cell_distance(cell, between, between, &length_um));
  FAILS(FILIFORM_USAGE, "from:", filiform_cell_path(cell, between, between, &points, &count));
  between.segment = 99;
  FAILS(FILIFORM_USAGE, "segment 99", filiform_cell_farthest_tip(cell, between, &tip, NULL, NULL));
  FAILS(FILIFORM_USAGE, "sample 99", filiform_cell_place(cell, 99, &tip));
  OK(filiform_cell_close(cell));
  OK(filiform_close(set));
}

/* ---- search */

static void nearest_finds_the_segments(void) {
  filiform_set *set = opened();
  const double point_um[3] = {35, 3, 0};
  filiform_hit hits[6];
  size_t count = 0;
  OK(filiform_nearest(set, point_um, NULL, hits, &count));
  CHECK(count == 1 && hits[0].distance_um == 3 && hits[0].sample == 5 && hits[0].segment == 4 && hits[0].exact);
  CHECK(near_to(hits[0].point_um[0], 35) && near_to(hits[0].t, 0.5) && hits[0].cell == 0);
  filiform_query query = FILIFORM_INIT(query);
  query.k = 6;
  OK(filiform_nearest(set, point_um, &query, hits, &count));
  CHECK(count == 6 && hits[5].distance_um >= hits[4].distance_um);
  query.max_distance_um = 4;
  OK(filiform_nearest(set, point_um, &query, hits, &count));
  CHECK(count == 1);
  query.approximate = 1;
  double radius_um = -1;
  OK(filiform_covering_radius(set, &radius_um));
  OK(filiform_nearest(set, point_um, &query, hits, &count));
  CHECK(radius_um >= 0);
  query.approximate = 0;
  query.epsilon = -1;
  FAILS(FILIFORM_USAGE, "epsilon", filiform_nearest(set, point_um, &query, hits, &count));
  const double nowhere[3] = {0, NAN, 0};
  FAILS(FILIFORM_USAGE, "", filiform_nearest(set, nowhere, NULL, hits, &count));
  CHECK(count == 0);
  FAILS(FILIFORM_USAGE, "hits: is NULL", filiform_nearest(set, point_um, NULL, NULL, &count));
  FAILS(FILIFORM_USAGE, "point_um: is NULL", filiform_nearest(set, NULL, NULL, hits, &count));
  OK(filiform_close(set));
}

static void many_points_at_once(void) {
  filiform_set *set = opened();
  enum { kPoints = 100, kEach = 7 };
  static double points_um[3 * kPoints];
  static filiform_hit hits[kPoints * kEach];
  static size_t counts[kPoints];
  for (int i = 0; i < kPoints; ++i) points_um[3 * i] = 0.5 * i;
  filiform_query query = FILIFORM_INIT(query);
  query.k = kEach;
  query.threads = 2;
  OK(filiform_nearest_many(set, points_um, kPoints, &query, hits, counts));
  for (int i = 0; i < kPoints; ++i) {
    filiform_hit alone;
    size_t count = 0;
    OK(filiform_nearest(set, points_um + 3 * i, NULL, &alone, &count));
    CHECK(counts[i] == 6 && alone.segment == hits[i * kEach].segment);
    CHECK(hits[i * kEach + 6].cell == FILIFORM_NONE && isinf(hits[i * kEach + 6].distance_um));
  }
  OK(filiform_nearest_many(set, points_um, kPoints, &query, hits, NULL));
  OK(filiform_nearest_many(set, NULL, 0, NULL, NULL, NULL));
  FAILS(FILIFORM_USAGE, "2^31", filiform_nearest_many(set, points_um, SIZE_MAX, &query, hits, NULL));
  OK(filiform_close(set));
}

static void regions(void) {
  filiform_set *set = opened();
  filiform_hit *hits = NULL;
  size_t count = 0;
  const double point_um[3] = {20, 0, 0}, lo_um[3] = {25, -1, -1}, hi_um[3] = {45, 1, 1};
  OK(filiform_within(set, point_um, 1, &hits, &count));
  CHECK(count == 3); /* the fork */
  filiform_free(hits);
  OK(filiform_box(set, lo_um, hi_um, &hits, &count));
  CHECK(count == 2);
  filiform_free(hits);
  FAILS(FILIFORM_USAGE, "", filiform_box(set, hi_um, lo_um, &hits, &count));
  FAILS(FILIFORM_USAGE, "", filiform_within(set, point_um, -1, &hits, &count));
  filiform_ray_query ray = FILIFORM_INIT(ray);
  ray.origin_um[0] = 35;
  ray.origin_um[1] = 100;
  ray.direction[1] = -1;
  ray.radius_um = 0.5;
  OK(filiform_ray(set, &ray, &hits, &count));
  CHECK(count == 1 && hits[0].sample == 5 && near_to(hits[0].along_um, 100));
  filiform_free(hits);
  ray.direction[1] = 0;
  FAILS(FILIFORM_USAGE, "", filiform_ray(set, &ray, &hits, &count));
  FAILS(FILIFORM_USAGE, "ray: is NULL", filiform_ray(set, NULL, &hits, &count));
  CHECK(hits == NULL && count == 0);
  OK(filiform_close(set));
}

/* ---- navigation */

static void travel_one_tick_at_a_time(uint32_t realtime) {
  filiform_set *set = opened();
  filiform_travel *travel = NULL;
  filiform_travel_options options = FILIFORM_INIT(options);
  options.realtime = realtime;
  options.zoom_um = 120;
  OK(filiform_travel_open(set, &options, &travel));
  OK(filiform_close(set)); /* the travel keeps it */
  filiform_tick tick = FILIFORM_INIT(tick);
  double hand_m[3] = {0, 0, 0};
  OK(filiform_travel_tick(travel, hand_m, 0.001, &tick));
  CHECK(tick.cell == FILIFORM_NONE && tick.force_N[0] == 0);
  const double start_um[3] = {5, 1, 0};
  OK(filiform_travel_jump_to(travel, start_um));
  double most_N = 0;
  for (int i = 0; i < 4000; ++i) {
    if (hand_m[0] < 0.03) hand_m[0] += 0.00002;
    OK(filiform_travel_tick(travel, hand_m, 0.001, &tick));
    const double force_N = sqrt(tick.force_N[0] * tick.force_N[0] + tick.force_N[1] * tick.force_N[1]);
    CHECK(force_N <= 8);
    if (force_N > most_N) most_N = force_N;
    if (realtime && tick.frontier) usleep(200);
  }
  CHECK(tick.proxy_um[0] > 30 && near_to(tick.proxy_um[1], 0) && tick.cell == 0 && tick.visited > 0);
  filiform_residency residency = FILIFORM_INIT(residency);
  OK(filiform_travel_residency(travel, &residency));
  CHECK(residency.reads > 0 && residency.bytes > 0 && residency.budget_bytes == UINT64_MAX);
  OK(filiform_travel_jump(travel, 0, (filiform_place){.segment = 6, .t = 0}));
  OK(filiform_travel_tick(travel, hand_m, 0.001, &tick));
  CHECK(near_to(tick.proxy_um[1], 30));
  OK(filiform_travel_zoom(travel, 2));
  OK(filiform_travel_rotate(travel, 0.1, 0));
  OK(filiform_travel_centre(travel));
  FAILS(FILIFORM_USAGE, "factor", filiform_travel_zoom(travel, -1));
  FAILS(FILIFORM_USAGE, "segment 99", filiform_travel_jump(travel, 0, (filiform_place){.segment = 99}));
  FAILS(FILIFORM_USAGE, "cell 7", filiform_travel_jump(travel, 7, (filiform_place){.segment = 1}));
  FAILS(FILIFORM_USAGE, "time step", filiform_travel_tick(travel, hand_m, 0, &tick));
  CHECK(tick.force_N[0] == 0);
  hand_m[1] = NAN;
  OK(filiform_travel_tick(travel, hand_m, 0.001, &tick));
  CHECK(tick.force_N[0] == 0 && tick.force_N[1] == 0 && tick.force_N[2] == 0);
  OK(filiform_travel_close(travel));
}

static void travel_in_virtual_time(void) { travel_one_tick_at_a_time(0); }
static void travel_in_real_time(void) { travel_one_tick_at_a_time(1); }

static void travel_refuses_wrong_options(void) {
  filiform_set *set = opened();
  filiform_travel *travel = NULL;
  filiform_travel_options options = FILIFORM_INIT(options);
  options.method = "teleport";
  FAILS(FILIFORM_USAGE, "teleport", filiform_travel_open(set, &options, &travel));
  options.method = "force";
  options.budget_bytes = 1;
  FAILS(FILIFORM_USAGE, "", filiform_travel_open(set, &options, &travel));
  options.budget_bytes = 0;
  options.rate_Hz = -1;
  FAILS(FILIFORM_USAGE, "rate", filiform_travel_open(set, &options, &travel));
  options.rate_Hz = 0;
  options.zoom_um = 1e7;
  FAILS(FILIFORM_USAGE, "zoom", filiform_travel_open(set, &options, &travel));
  options.zoom_um = 0;
  OK(filiform_travel_open(set, &options, &travel));
  OK(filiform_travel_close(travel));
  OK(filiform_close(set));
}

static int stop_after(void *user, const filiform_run_tick *tick) {
  uint64_t *last = user;
  CHECK(tick->tick <= *last);
  return tick->tick == *last;
}

static void runs_are_repeatable(void) {
  filiform_set *set = opened();
  filiform_run_options options = FILIFORM_INIT(options);
  filiform_run_summary first = FILIFORM_INIT(first), second = FILIFORM_INIT(second);
  options.route = "1:7";
  options.zoom_um = 100;
  OK(filiform_navigate(set, &options, &first));
  OK(filiform_navigate(set, &options, &second));
  CHECK(first.outcome == FILIFORM_COMPLETED && near_to(first.route_um, 50));
  CHECK(first.ticks == second.ticks && first.max_force_N == second.max_force_N && first.max_force_N < 8);
  OK(filiform_navigate(set, NULL, &first));
  uint64_t last = 10;
  options.on_tick = stop_after;
  options.user = &last;
  OK(filiform_navigate(set, &options, &first));
  CHECK(first.outcome == FILIFORM_STOPPED && first.ticks == 11);
  options.route = "nowhere";
  FAILS(FILIFORM_USAGE, "nowhere", filiform_navigate(set, &options, &first));
  options.route = "tour:1";
  options.device = "null";
  FAILS(FILIFORM_USAGE, "example device sim:medium", filiform_navigate(set, &options, &first)); /* no option of the program */
  options.route = NULL;
  options.device = "sim:soft";
  FAILS(FILIFORM_USAGE, "soft", filiform_navigate(set, &options, &first));
  options.device = NULL;
  const double zooms_um[] = {1e300, 1e7, 3e5, 1e-7, -1};
  for (size_t i = 0; i < sizeof zooms_um / sizeof *zooms_um; ++i) {
    options.zoom_um = zooms_um[i];
    FAILS(FILIFORM_USAGE, "zoom", filiform_navigate(set, &options, &first));
  }
  OK(filiform_close(set));
}

/* ---- mistakes */

static void closed_null_and_invented_handles_are_refused(void) {
  filiform_set *set = opened(), *again = NULL;
  filiform_info info = FILIFORM_INIT(info);
  filiform_cell *cell = cell_of(set);
  filiform_cell_arrays arrays = FILIFORM_INIT(arrays);
  FAILS(FILIFORM_USAGE, "set: is NULL", filiform_get_info(NULL, &info));
  FAILS(FILIFORM_USAGE, "another kind", filiform_get_info((filiform_set *)(void *)cell, &info));
  FAILS(FILIFORM_USAGE, "another kind", filiform_close((filiform_set *)(void *)cell));
  OK(filiform_close(set));
  FAILS(FILIFORM_USAGE, "set: is closed", filiform_get_info(set, &info));
  FAILS(FILIFORM_USAGE, "set: is closed", filiform_close(set));
  again = opened(); /* in the same slot */
  FAILS(FILIFORM_USAGE, "set: is closed", filiform_get_info(set, &info));
  OK(filiform_close(again));
  int elsewhere = 0;
  FAILS(FILIFORM_USAGE, "never opened", filiform_get_info((filiform_set *)(void *)&elsewhere, &info));
  FAILS(FILIFORM_USAGE, "never opened", filiform_get_info((filiform_set *)UINTPTR_MAX, &info));
  OK(filiform_cell_close(cell));
  FAILS(FILIFORM_USAGE, "cell: is closed", filiform_cell_get_arrays(cell, &arrays));
  OK(filiform_close(NULL));
  OK(filiform_cell_close(NULL));
  OK(filiform_travel_close(NULL));
  filiform_free(NULL);
  FAILS(FILIFORM_USAGE, "name: is NULL", filiform_open(NULL, NULL, &set));
  FAILS(FILIFORM_USAGE, "set: is NULL", filiform_open(set_path, NULL, NULL));
  FAILS(FILIFORM_IO, "nowhere.fil", filiform_open("/nowhere.fil", NULL, &set));
  CHECK(set == NULL);
  CHECK(strcmp(filiform_status_name(FILIFORM_CORRUPT), "FILIFORM_CORRUPT") == 0);
  CHECK(strcmp(filiform_status_name(-3), "unknown status") == 0 && filiform_version()[0] != '\0');
}

static void damage_is_found(void) {
  char command[1400], damaged[400];
  snprintf(damaged, sizeof damaged, "%s/damaged.fil", folder);
  snprintf(command, sizeof command, "cp -r '%s' '%s' && for f in '%s'/*/tiles-*.pack; do "
           "head -c $(stat -c %%s \"$f\") /dev/zero >\"$f.new\" && mv \"$f.new\" \"$f\"; done",
           set_path, damaged, damaged);
  CHECK(system(command) == 0);
  filiform_set *set = NULL;
  CHECK(filiform_open(damaged, NULL, &set) == FILIFORM_OK);
  const double point_um[3] = {0, 0, 0};
  filiform_hit hit;
  size_t count = 3;
  FAILS(FILIFORM_CORRUPT, "damaged.fil", filiform_nearest(set, point_um, NULL, &hit, &count));
  CHECK(count == 0);
  OK(filiform_close(set));
}

static void a_child_process_opens_its_own(void) {
  filiform_set *set = opened();
  fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    filiform_info info = FILIFORM_INIT(info);
    filiform_set *own = NULL;
    const int refused = filiform_get_info(set, &info) == FILIFORM_USAGE && strstr(filiform_error_text(), "fork") != NULL;
    const int ignored = filiform_close(set) == FILIFORM_OK;
    const int works = filiform_open(set_path, NULL, &own) == FILIFORM_OK &&
                      filiform_get_info(own, &info) == FILIFORM_OK && filiform_close(own) == FILIFORM_OK;
    _exit(refused && ignored && works ? 0 : 1);
  }
  int status = -1;
  CHECK(waitpid(child, &status, 0) == child && status == 0);
  filiform_info info = FILIFORM_INIT(info);
  OK(filiform_get_info(set, &info)); /* the parent's is as before */
  OK(filiform_close(set));
}

/* ---- threads */

static filiform_set *shared;

static void *search_and_reopen(void *argument) {
  const int seed = *(const int *)argument;
  for (int i = 0; i < 200; ++i) {
    const double point_um[3] = {(i * 7 + seed * 3) % 40, (i * 5) % 30, 1};
    filiform_hit hit;
    size_t count = 0;
    CHECK(filiform_nearest(shared, point_um, NULL, &hit, &count) == FILIFORM_OK && count == 1);
    filiform_cell *cell = cell_of(shared);
    double length_um = 0;
    CHECK(filiform_cell_distance(cell, place_of(cell, 1), place_of(cell, 7), &length_um) == FILIFORM_OK);
    OK(filiform_cell_close(cell));
    filiform_set *own = opened();
    OK(filiform_close(own));
    CHECK(filiform_get_info(own, NULL) == FILIFORM_USAGE && filiform_error_text()[0] != '\0');
  }
  return NULL;
}

static void threads_share_a_set(void) {
  pthread_t threads[4];
  int seeds[4] = {0, 1, 2, 3};
  shared = opened();
  for (int i = 0; i < 4; ++i) CHECK(pthread_create(&threads[i], NULL, search_and_reopen, &seeds[i]) == 0);
  for (int i = 0; i < 4; ++i) pthread_join(threads[i], NULL);
  OK(filiform_close(shared));
}

static void *use_until_closed(void *argument) {
  (void)argument;
  const double point_um[3] = {1, 2, 3};
  filiform_hit hit;
  size_t count = 0;
  int status = FILIFORM_OK;
  while (status == FILIFORM_OK) status = filiform_nearest(shared, point_um, NULL, &hit, &count);
  CHECK(status == FILIFORM_USAGE && strstr(filiform_error_text(), "closed") != NULL);
  return NULL;
}

static void a_set_may_be_closed_during_calls(void) {
  pthread_t threads[3];
  shared = opened();
  for (int i = 0; i < 3; ++i) CHECK(pthread_create(&threads[i], NULL, use_until_closed, NULL) == 0);
  usleep(20000);
  OK(filiform_close(shared));
  for (int i = 0; i < 3; ++i) pthread_join(threads[i], NULL);
}

static void many_opens_leak_nothing(void) { /* the address sanitizer looks */
  for (int i = 0; i < 2000; ++i) {
    filiform_set *set = opened();
    OK(filiform_close(set));
  }
}

#define RUN(test)                                                                 \
  do {                                                                            \
    const int before = failures;                                                  \
    test();                                                                       \
    printf("[%s] CInterface.%s (0 ms)\n", failures == before ? "       OK " : "  FAILED  ", #test); \
  } while (0)

int main(void) {
  snprintf(folder, sizeof folder, "%s/filiform-c-XXXXXX", getenv("TMPDIR") != NULL ? getenv("TMPDIR") : "/tmp");
  if (mkdtemp(folder) == NULL) abort();
  snprintf(set_path, sizeof set_path, "%s/cell.fil", folder);
  snprintf(swc_path, sizeof swc_path, "%s/cell.swc", folder);
  write_file(swc_path, kCell);
  RUN(ingest_makes_a_set);
  RUN(ingest_stops_when_the_callback_asks);
  RUN(ingest_refuses_wrong_arguments);
  RUN(attributes_and_where);
  RUN(measures);
  RUN(filters_counts_and_levels);
  RUN(a_view_of_a_view_has_what_both_leave);
  RUN(an_older_struct_is_taken);
  RUN(info_states_counts_and_box);
  RUN(cells_have_names);
  RUN(a_cell_is_arrays);
  RUN(paths_follow_the_cell);
  RUN(nearest_finds_the_segments);
  RUN(many_points_at_once);
  RUN(regions);
  RUN(travel_in_virtual_time);
  RUN(travel_in_real_time);
  RUN(travel_refuses_wrong_options);
  RUN(runs_are_repeatable);
  RUN(closed_null_and_invented_handles_are_refused);
  RUN(damage_is_found);
  RUN(a_child_process_opens_its_own);
  RUN(threads_share_a_set);
  RUN(a_set_may_be_closed_during_calls);
  RUN(many_opens_leak_nothing);
  char command[400];
  snprintf(command, sizeof command, "rm -rf '%s'", folder);
  if (system(command) != 0) ++failures;
  printf("%d failures\n", failures);
  return failures == 0 ? 0 : 1;
}
