/* Rounds the corners of a five-axis tool path: the plain C program that `make bench` measures cornersmooth against.

   It reads a cutter-location file with strtod, replaces each corner of tip and axis point by a pair of cubic NURBS with
   five control points (the "proportional" transition: the same fraction of both segments, one parameter) and writes NC
   text with fprintf. Written as one would write it without further ado: no option but the four numbers, no report, no
   verification, of CL only what make_clsf.py writes. It does less than cornersmooth: the axis point is not corrected
   for its constant distance H, nothing is set aside for rounding, and the axis sets no number of lines.

   baseline IN OUT TOLERANCE H [--g6.2]                                      lengths in mm */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct { double x, y, z; } vec;
typedef struct { vec tip, axis; double feed; int rapid; } pose;
typedef struct { vec tip, point; } pair;   /* tip and axis point, or a step of both */

static const pair zero = {{0, 0, 0}, {0, 0, 0}};

static double tolerance, height;
static int curves;                         /* --g6.2 */
static FILE *out;
static double written_feed = -1;

static vec add(vec a, vec b, double t) { return (vec){a.x + t * b.x, a.y + t * b.y, a.z + t * b.z}; }
static double dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static double norm(vec a) { return sqrt(dot(a, a)); }
static vec unit(vec a) { return add(zero.tip, a, 1 / norm(a)); }

static pair pair_add(pair a, pair b, double t) { return (pair){add(a.tip, b.tip, t), add(a.point, b.point, t)}; }
static double pair_norm(pair a) { return sqrt((dot(a.tip, a.tip) + dot(a.point, a.point)) / 2); }
static pair pair_unit(pair a) { return pair_add(zero, a, 1 / pair_norm(a)); }
static pair pair_of(const pose *p) { return (pair){p->tip, add(p->tip, p->axis, height)}; }

static void die(const char *what, const char *name)
{
    fprintf(stderr, "baseline: %s %s\n", what, name);
    exit(1);
}

/* ---- reading ------------------------------------------------------------------------------------------------- */

static char *read_all(const char *name)
{
    FILE *in = fopen(name, "rb");
    long size;
    char *text;
    if (!in || fseek(in, 0, SEEK_END) || (size = ftell(in)) < 0)
        die("cannot read", name);
    rewind(in);
    text = malloc(size + 1);
    if (!text || fread(text, 1, size, in) != (size_t)size)
        die("cannot read", name);
    text[size] = 0;
    fclose(in);
    return text;
}

static char *numbers(char *at, double *into, int count)
{
    for (int i = 0; i < count; i++) {
        char *end;
        into[i] = strtod(at, &end);
        if (end == at)
            die("not a number:", at);
        at = *end == ',' ? end + 1 : end;
    }
    return at;
}

static int starts(const char *at, const char *word) { return !strncmp(at, word, strlen(word)); }

static pose *read_poses(char *at, int *count)
{
    int room = 1 << 16, n = 0, rapid = 0;
    double feed = 0, v[6];
    pose *poses = malloc(room * sizeof *poses);
    while (*at) {
        if (starts(at, "GOTO/")) {
            at = numbers(at + 5, v, 6);
            if (n == room)
                poses = realloc(poses, (room *= 2) * sizeof *poses);
            if (!poses)
                die("out of", "memory");
            poses[n++] = (pose){{v[0], v[1], v[2]}, unit((vec){v[3], v[4], v[5]}), feed, rapid};
            rapid = 0;
        } else if (starts(at, "FEDRAT/MMPM,")) {
            at = numbers(at + 12, &feed, 1);
        } else if (starts(at, "RAPID")) {
            rapid = 1;
        }
        at = strchr(at, '\n');
        if (!at)
            break;
        at++;
    }
    *count = n;
    return poses;
}

/* ---- writing ------------------------------------------------------------------------------------------------- */

static double whole(double v, double half) { return fabs(v) < half ? 0.0 : v; }   /* no -0.0000 */

static void write_words(pair p)
{
    vec t = p.tip, q = p.point;
    fprintf(out, "X%.4f Y%.4f Z%.4f", whole(t.x, 5e-5), whole(t.y, 5e-5), whole(t.z, 5e-5));
    if (curves) {
        q = add(t, unit(add(q, t, -1)), height);
        fprintf(out, " U%.4f V%.4f W%.4f", whole(q.x, 5e-5), whole(q.y, 5e-5), whole(q.z, 5e-5));
    } else {
        q = unit(add(q, t, -1));
        fprintf(out, " I%.7f J%.7f K%.7f", whole(q.x, 5e-8), whole(q.y, 5e-8), whole(q.z, 5e-8));
    }
}

static void write_line(pair p, double feed, int rapid)
{
    fputs(rapid ? "G0 " : "G1 ", out);
    write_words(p);
    if (!rapid && feed != written_feed) {
        fprintf(out, feed == floor(feed) ? " F%.0f." : " F%.4f", feed);
        written_feed = feed;
    }
    putc('\n', out);
}

static void write_control_point(pair p, const char *before, const char *after)
{
    fputs(before, out);
    write_words(p);
    fputs(after, out);
}

/* ---- rounding ------------------------------------------------------------------------------------------------ */

/* Control points of the transition at `at`; 0 where the corner stays sharp. */
static int round_corner(const pose *before, const pose *at, const pose *after, pair point[5], double *bend)
{
    pair x = pair_of(at), in = pair_add(x, pair_of(before), -1), leave = pair_add(pair_of(after), x, -1), change;
    double m_in = pair_norm(in), m_out = pair_norm(leave), tip, axis, length;
    const double c = 1.0 / 6;
    if (m_in < 1e-6 || m_out < 1e-6)
        return 0;
    if (curves && at->feed != after->feed)
        return 0;                          /* a curve has one feed */
    in = pair_unit(in);
    leave = pair_unit(leave);
    change = pair_add(leave, in, -1);
    tip = norm(change.tip);
    axis = norm(change.point);
    if (pair_norm(change) > 2 * sin(85 * M_PI / 180) || (tip < 1e-9 && axis < 1e-9))
        return 0;                          /* reversal by more than 170 degrees, or straight on */
    length = fmin(m_in, m_out) / 2;
    length = fmin(length, tolerance / (c * fmax(tip, axis)));
    *bend = length * fmax(tip, axis);
    point[0] = pair_add(x, in, -length);
    point[1] = pair_add(x, in, -length * 2 / 3);
    point[2] = x;
    point[3] = pair_add(x, leave, length * 2 / 3);
    point[4] = pair_add(x, leave, length);
    return 1;
}

/* Point of the curve with knots 0 0 0 0 1/2 1 1 1 1, all weights 1. */
static pair curve_at(const pair point[5], double u)
{
    int back = u > 0.5;
    double s = 2 * (back ? 1 - u : u), r = 1 - s;
    double b[4] = {r * r * r, s * (3 - s * (4.5 - 1.75 * s)), s * s * (1.5 - s), s * s * s / 4};
    pair sum = zero;
    for (int i = 0; i < 4; i++)
        sum = pair_add(sum, point[back ? 4 - i : i], b[i]);
    return sum;
}

static void write_transition(const pair point[5], double bend, double feed_in, double feed_out)
{
    if (curves) {
        for (int i = 0; i < 5; i++)
            write_control_point(point[i], i == 0 ? "G6.2 P4 K0. " : i == 4 ? "K0.5 " : "K0. ", " R1.\n");
        fputs("K1.\nK1.\nK1.\nK1.\n", out);
        return;
    }
    int n = (int)fmax(1, ceil(sqrt(bend / (15.6 * tolerance / 10))));
    for (int k = 1; k <= n; k++)
        write_line(curve_at(point, 0.5 * pow((double)k / n, 2.0 / 3)), feed_in, 0);
    for (int k = n - 1; k >= 0; k--)
        write_line(curve_at(point, 1 - 0.5 * pow((double)k / n, 2.0 / 3)), feed_out, 0);
}

static void write_path(const pose *p, int n)
{
    pair last = zero, point[5];
    for (int i = 0; i < n; i++) {
        double bend;
        int corner = i > 0 && i + 1 < n && !p[i].rapid && !p[i + 1].rapid;
        if (!corner || !round_corner(&p[i - 1], &p[i], &p[i + 1], point, &bend)) {
            last = pair_of(&p[i]);
            write_line(last, p[i].feed, p[i].rapid);
            continue;
        }
        if (pair_norm(pair_add(point[0], last, -1)) > 1e-4)
            write_line(point[0], p[i].feed, 0);
        write_transition(point, bend, p[i].feed, p[i + 1].feed);
        last = point[4];
    }
}

int main(int argc, char **argv)
{
    int n;
    pose *poses;
    char *text;
    if (argc < 5 || argc > 6 || (argc == 6 && strcmp(argv[5], "--g6.2")))
        die("usage:", "baseline IN OUT TOLERANCE H [--g6.2]");
    tolerance = atof(argv[3]);
    height = atof(argv[4]);
    curves = argc == 6;
    text = read_all(argv[1]);
    poses = read_poses(text, &n);
    free(text);
    if (!(out = fopen(argv[2], "wb")))
        die("cannot write", argv[2]);
    setvbuf(out, NULL, _IOFBF, 1 << 20);
    fprintf(out, "%%\nO0001\nG21 G90 G94 G17 G40 G49 G80\nT1 M6\nS12000 M3\nM8\n%s", curves ? "" : "G43.5 H1\n");
    write_path(poses, n);
    fprintf(out, "%sM30\n%%\n", curves ? "" : "G49\n");
    if (fclose(out))
        die("cannot write", argv[2]);
    return 0;
}
