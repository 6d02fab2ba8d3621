/* Force and area of an island from a table of one's own, by the C that
   `mbma export c --table mine.nc --out c` writes; README has the commands. */
#include <stdio.h>
#include "mbma_model.h"

int main(void)
{
    mbma_answer phi;
    if (mbma_phi_of(2.0, 0.1, &phi) != MBMA_OK) /* X and mu */
        return 1;
    printf("C: Phi_F %.6f, Phi_A %.6f, within %.1e\n", phi.phi_F, phi.phi_A, phi.error);
    return 0;
}
