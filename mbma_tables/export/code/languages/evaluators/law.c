/* Quantities of a law as functions of overclosure, of which each law has the numbers. */
#include "mbma.h"
#include "elementary.h"

/* A quantity: `ratio` times the slope of a law, and a curve of its own, either of which may be NULL. */
typedef struct {
    const mbma_law *sloped;
    double ratio;
    const mbma_law *curve;
    double begin, end;       /* overclosures below which bodies are apart, and beyond which it is not known */
    double offset;           /* taken off the curve */
    double apart, far, jump; /* of parted bodies it is apart + far/(u + jump), */
    double h_rms;            /* or where this is not zero, flow of wide gaps */
    double unknown_from;     /* overclosure from which on a flow that is blocked is not known */
} mbma_function;

/* A power of c may overflow where c is no normal number. */
MBMA_INLINE double mbma_curvature(const mbma_law *law, double c) {
    return mbma_law_at_overclosure(law, MBMA_CURVATURE, c > 0.0 && c < 2.3e-308 ? 2.3e-308 : c);
}

/* A quantity of the law itself and its derivative by c, which is NaN where a law has none. */
MBMA_INLINE double mbma_quantity_at(const mbma_law *law, mbma_quantity what, double c, double *by_c) {
    if (what == MBMA_FORCE || what == MBMA_AREA)
        return mbma_law_and_slope(law, what, c, by_c);
    *by_c = (double)NAN;
    if (what == MBMA_ENERGY)
        *by_c = mbma_law_at_overclosure(law, MBMA_FORCE, c);
    if (what == MBMA_STIFFNESS)
        *by_c = mbma_curvature(law, c);
    return mbma_law_at_overclosure(law, what, c);
}

MBMA_INLINE double mbma_curve_at(const mbma_function *of, double h_max, double c, double *by_c) {
    const double u = h_max - c;
    if (of->h_rms > 0.0) {
        const double flow = mbma_law_flow(of->curve, h_max, of->h_rms, h_max - 2.0 * c, by_c);
        return !(flow <= 0.0) ? flow : (*by_c = c >= of->unknown_from ? (double)NAN : 0.0);
    }
    if (c > of->end)
        return *by_c = (double)NAN;
    if (c < of->begin) {
        const double far = of->far / (u + of->jump);
        *by_c = far / (u + of->jump);
        return of->apart + far;
    }
    /* one that begins at first contact keeps its digits there */
    if (of->curve->head->plus < 0.0)
        return mbma_law_and_slope(of->curve, MBMA_FORCE, c, by_c) - of->offset;
    *by_c = mbma_law_at(of->curve, MBMA_STIFFNESS, h_max - 2.0 * c);
    return mbma_law_at(of->curve, MBMA_FORCE, h_max - 2.0 * c) - of->offset;
}

/* A quantity and its derivative by c, in the range of a law; NaN outside. */
MBMA_INLINE double mbma_function_at(const mbma_function *of, const mbma_law *law, double c, double *by_c) {
    const double d = law->head->h_max - 2.0 * c;
    double value = 0.0;
    *by_c = 0.0;
    if (!(law->head->lowest <= d && (law->head->ends || d <= law->head->highest)))
        return *by_c = (double)NAN;
    if (of->curve)
        value = mbma_curve_at(of, law->head->h_max, c, by_c);
    if (of->sloped) {
        *by_c += of->ratio * mbma_curvature(of->sloped, c);
        value += of->ratio * mbma_law_at_overclosure(of->sloped, MBMA_STIFFNESS, c);
    }
    return value;
}
