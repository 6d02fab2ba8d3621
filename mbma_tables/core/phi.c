/* Islands by the universal table: Phi_F and Phi_A over X and mu (34-40). */
#include "phi.h"

/* Slopes are not computed if the flag is constant and false. */
MBMA_INLINE mbma_status fill(phi found, bool slopes, double *row) {
    row[0] = found.value[0], row[1] = found.value[1], row[2] = found.error;
    for (int q = 0; q < 2 && slopes; q++)
        row[3 + 2 * q] = found.by_X[q], row[4 + 2 * q] = found.by_mu[q];
    return (mbma_status)found.status;
}

size_t mbma_phi(size_t n, const double *X, const double *mu, const mbma_cells *cells, int slopes, double *out,
                uint8_t *status) {
    size_t bad = 0;
    for (size_t k = 0; k < n; k++) {
        const mbma_status found = slopes ? fill(phi_at(cells, X[k], mu[k]), true, out + 7 * k)
                                         : fill(phi_at(cells, X[k], mu[k]), false, out + 3 * k);
        bad += found != MBMA_OK;
        if (status)
            status[k] = (uint8_t)found;
    }
    return bad;
}
