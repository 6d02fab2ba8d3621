/* The calibrated law and Persson's theory of many spectra, each at few gaps or forces.
 *
 * `mbma_spectrum_law_of` makes the polynomials of one spectrum, which is worth its time from
 * hundreds of entries on. Here the sum over wavenumbers is taken at each step of Newton's method.
 * Units are those of `spectrum_laws.c`.
 */
#ifndef MBMA_SPECTRA_H
#define MBMA_SPECTRA_H

#include "mbma.h"

/* Parts of power spectra: C(q) = C_low (q/q_low)^power from q_low to q_high, numbers in this
 * order; parts of one surface may overlap, and add. A part without height has C_low = 0. */
enum { MBMA_PART_NUMBERS = 4, MBMA_MOST_PARTS = 16 };

/* Numbers of a surface that the loops need beside its wavenumbers. */
typedef struct {
    double count;            /* of wavenumbers, with those that fill the last chunk */
    double first;            /* of the numbers of the wavenumbers */
    double narrowness;       /* harmonic over arithmetic mean wavenumber, weighted by variance */
    double s0, tail, h_max;  /* of the area, of forces at large gaps, and of contact */
    double end;              /* ln F at h_max of a surface without end */
    double light, light_end; /* u = light_end - light ln F at light loads */
} mbma_spectrum_numbers;

/* The inner integral of the weight W, times exp(2 y^2), as polynomials of the place in equal cells
 * of ln y, the place running from -1 to 1: for the narrowness that constants refer to, and its
 * derivative by that. Below the first cell it is linear in ln y. */
enum { MBMA_INNER_TERMS = 6, MBMA_MOST_INNER_CELLS = 256 };
typedef struct {
    size_t cells;
    double first, rate, narrowness;
    const double *polynomials, *slopes;
} mbma_inner;

/* Surfaces. The wavenumbers of one are three rows: the place of ln g among the cells, 1/g^2 - 1,
 * and the share of u; g is the gradient of smaller wavenumbers over that of all. */
typedef struct {
    size_t count, words; /* surfaces, and numbers of all wavenumbers */
    const double *waves;
    const mbma_spectrum_numbers *numbers;
    double area_t0;
} mbma_spectra;

enum { MBMA_WAVE_CHUNK = 32, MBMA_MOST_WAVES = 2048 };

/* Wavenumbers and numbers of surfaces of `parts` each, of Nayak's alpha `alpha`, whose contact
 * begins at h_max [h_rms], perhaps infinite. Returns how many are no spectra, or find no room
 * among `words` numbers; their count is 0. 3 MBMA_MOST_WAVES words a surface are enough. */
size_t mbma_spectra_of(size_t n, size_t parts, const double *laws, const double *alpha,
                       const double *h_max, const mbma_law_constants *constants,
                       const mbma_inner *inner, size_t words, double *waves,
                       mbma_spectrum_numbers *numbers);

/* As `mbma_calibrated_contact` and `mbma_calibrated_separation`. */
size_t mbma_spectra_contact(const mbma_spectra *spectra, const mbma_inner *inner, size_t n,
                            const int64_t *owner, const double *u, double *force, double *area,
                            double *stiffness);
size_t mbma_spectra_separation(const mbma_spectra *spectra, const mbma_inner *inner, size_t n,
                               const int64_t *owner, const double *force, double *u);

enum { MBMA_ENERGY_NODES = 40 };

/* Integrals of force from u to h_max, over A0 E* g h_rms. `rule` has Gauss's nodes on [-1, 1] and
 * their weights, MBMA_ENERGY_NODES of each. */
size_t mbma_spectra_energy(const mbma_spectra *spectra, const mbma_inner *inner,
                           const double *rule, size_t n, const int64_t *owner, const double *u,
                           double *energy);

/* Of the flow: contact fraction from which gaps do not percolate, and the power of smaller ones by
 * which contact obstructs. */
typedef struct {
    double threshold, obstruction;
} mbma_flow_constants;

enum { MBMA_FLOW_NODES = 32 };

/* ln R of the gaps of surfaces at loads F over A0 E* g: their flow over that of gaps of the same
 * mean without contact; -infinity where they do not percolate. `rule` has Gauss's nodes on [-1, 1]
 * and their weights, MBMA_FLOW_NODES of each. */
size_t mbma_gap_flow(size_t surfaces, size_t parts, const double *laws, const double *alpha,
                     const mbma_law_constants *constants, const mbma_inner *inner,
                     const mbma_flow_constants *flow, const double *rule, size_t n,
                     const int64_t *owner, const double *load, double *factor);

#endif
