"""Typed access to the quantities of the registry, written by `python -m generate quantities`; do not edit."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from mbma_tables.common.arguments import Numbers


class ContactQuantities:
    """Quantities of a contact; `quantity` computes them."""

    def quantity(self, name: str) -> Any:
        """A quantity by its name."""
        raise NotImplementedError

    @property
    def mean_separation(self) -> Numbers:
        """Mean separation u = (h_max + d)/2 (50) [length]: the mean gap, with yielded points flattened."""
        value: Numbers = self.quantity("mean_separation")
        return value

    @property
    def separation(self) -> Numbers:
        """Separation d between the rigid plane and the mid-plane [length]."""
        value: Numbers = self.quantity("separation")
        return value

    @property
    def plane_separation(self) -> Numbers:
        """Gap between the mean planes [length]: u less the flattening of yielded points."""
        value: Numbers = self.quantity("plane_separation")
        return value

    @property
    def pressure(self) -> Numbers:
        """F/A0 in the unit of E*; F/(A0 E*) where that is 1."""
        value: Numbers = self.quantity("pressure")
        return value

    @property
    def area(self) -> Numbers:
        """A/A0; that of MBMA does not end at 1 under full compression, and is not clamped."""
        value: Numbers = self.quantity("area")
        return value

    @property
    def mean_pressure(self) -> Numbers:
        """Mean pressure in the contact, F/A [stress]; NaN where there is none."""
        value: Numbers = self.quantity("mean_pressure")
        return value

    @property
    def yielded(self) -> Numbers:
        """Share of the contact area at the hardness, 0 to 1."""
        value: Numbers = self.quantity("yielded")
        return value

    @property
    def psi(self) -> Numbers:
        """Plasticity index E* g/p_m, g the rms gradient; 0 where the hardness is infinite."""
        value: Numbers = self.quantity("psi")
        return value

    @property
    def elastic_hardness(self) -> Numbers:
        """Hardness above which the elastic area is within 5%, E* g/1.1 [stress]."""
        value: Numbers = self.quantity("elastic_hardness")
        return value

    @property
    def stiffness(self) -> Numbers:
        """-d(F/A0)/du [stress/length] of first loading, against the mean separation."""
        value: Numbers = self.quantity("stiffness")
        return value

    @property
    def unloading_stiffness(self) -> Numbers:
        """-d(F/A0)/du [stress/length] of a small unloading at constant contact area; `stiffness` if nothing yields.

        Of bodies that attract each other it is the elastic one at this gap, without the change of the attraction.
        """
        value: Numbers = self.quantity("unloading_stiffness")
        return value

    @property
    def tangential_stiffness(self) -> Numbers:
        """Tangential stiffness of full stick [stress/length], `unloading_stiffness`/kappa (Mindlin 1949)."""
        value: Numbers = self.quantity("tangential_stiffness")
        return value

    @property
    def energy(self) -> Numbers:
        """Elastic energy per nominal area [stress length] that unloading gives back, the integral of F/A0 over u."""
        value: Numbers = self.quantity("energy")
        return value

    @property
    def total_conductance(self) -> Numbers:
        """Thermal conductance of the solid spots and of the gas in parallel [W/(m^2 K)]."""
        value: Numbers = self.quantity("total_conductance")
        return value

    @property
    def solid_conductance(self) -> Numbers:
        """Thermal or electrical conductance of the solid spots, h = (k_s/E*) (-dF/du), at constant contact area.

        Conductance and stiffness solve the same potential problem (J. R. Barber, Proc. R. Soc. A
        459 (2003) 53). In W/(m^2 K) for conductivities such as "45 W/(m K)", in S/m^2 for "6e6 S/m".
        The slope of the loading curve of yielded contacts is up to ten times smaller.
        """
        value: Numbers = self.quantity("solid_conductance")
        return value

    @property
    def gas_conductance(self) -> Numbers:
        """Thermal conductance of the gas in the gaps, parallel to that of the solid spots [W/(m^2 K)]."""
        value: Numbers = self.quantity("gas_conductance")
        return value

    @property
    def total_conductance_scatter(self) -> Numbers:
        """Model uncertainty, one standard deviation of ln `total_conductance` at this pressure.

        Those of `solid_conductance` and `gas_conductance`, each times its share of the total, in
        quadrature.
        """
        value: Numbers = self.quantity("total_conductance_scatter")
        return value

    @property
    def solid_conductance_scatter(self) -> Numbers:
        """Model uncertainty, one standard deviation of ln `solid_conductance` at this pressure.

        That of the unloading stiffness, to which the conductance is proportional. The
        uncertainty of the conductivities is not included.
        """
        value: Numbers = self.quantity("solid_conductance_scatter")
        return value

    @property
    def gas_conductance_scatter(self) -> Numbers:
        """Model uncertainty, one standard deviation of ln `gas_conductance` at this pressure; 0 in vacuum.

        That of the distribution of gaps, by simulations with known mean gap and area, and that
        of the mean gap (`separation_scatter`), in quadrature. NaN where no simulation was
        compared: of areas outside 0.1% to 75%, and temperature jumps below 0.03 h_rms. The
        uncertainty of the gas's conductivity and accommodation is not included.
        """
        value: Numbers = self.quantity("gas_conductance_scatter")
        return value

    @property
    def flow_coefficient(self) -> Numbers:
        """Flow coefficient K of the gaps [length^3], `leakage.K`."""
        value: Numbers = self.quantity("flow_coefficient")
        return value

    @property
    def hydraulic_aperture(self) -> Numbers:
        """K^(1/3) [length], the gap of parallel plates with the same flow."""
        value: Numbers = self.quantity("hydraulic_aperture")
        return value

    @property
    def leakage_scatter(self) -> Numbers:
        """Model uncertainty, one standard deviation of ln of the flow coefficient."""
        value: Numbers = self.quantity("leakage_scatter")
        return value

    @property
    def leak_rate(self) -> Numbers:
        """Leak rate of the joint's seal, in its unit: that of `Leakage.gas` or `Leakage.liquid`."""
        value: Numbers = self.quantity("leak_rate")
        return value

    @property
    def leak_rate_scatter(self) -> Numbers:
        """Model uncertainty, one standard deviation of ln `leak_rate`: that of the flow coefficient and of the law of gases."""
        value: Numbers = self.quantity("leak_rate_scatter")
        return value

    @property
    def median_gap(self) -> Numbers:
        """Median of the open gaps [length], by the law of docs/adhesion.md, of a simulated map by the map itself."""
        value: Numbers = self.quantity("median_gap")
        return value

    @property
    def attraction(self) -> Numbers:
        """Mean attraction that presses the contact beside the load [stress], effective less net pressure."""
        value: Numbers = self.quantity("attraction")
        return value

    @property
    def pull_off(self) -> Numbers:
        """Largest tension F/A0 that the bodies bear, at least 0 [stress], of the surface and bodies."""
        value: Numbers = self.quantity("pull_off")
        return value

    @property
    def zero_load_gap(self) -> Numbers:
        """Mean gap of the bodies at zero load [length], after they were pressed together."""
        value: Numbers = self.quantity("zero_load_gap")
        return value

    @property
    def zero_load_area(self) -> Numbers:
        """A/A0 at zero load, after the bodies were pressed together."""
        value: Numbers = self.quantity("zero_load_area")
        return value

    @property
    def effective_work(self) -> Numbers:
        """Work per nominal area of parting the bodies from zero load [stress length], the integral of the tension over u."""
        value: Numbers = self.quantity("effective_work")
        return value

    @property
    def tabor_number(self) -> Numbers:
        """Tabor's number of a summit, (2 w^2/(c E*^2 rho^3))^(1/3) with the rms Laplacian c of the heights."""
        value: Numbers = self.quantity("tabor_number")
        return value

    @property
    def error(self) -> Numbers:
        """Bound on the relative numerical error of pressure and area against the theory; NaN where not known."""
        value: Numbers = self.quantity("error")
        return value

    @property
    def scatter(self) -> Numbers:
        """Model uncertainty, one standard deviation of ln F at this mean separation; NaN if unknown."""
        value: Numbers = self.quantity("scatter")
        return value

    @property
    def area_scatter(self) -> Numbers:
        """Model uncertainty, one standard deviation of ln A at this pressure."""
        value: Numbers = self.quantity("area_scatter")
        return value

    @property
    def stiffness_scatter(self) -> Numbers:
        """Model uncertainty, one standard deviation of ln `stiffness` at this pressure.

        NaN where a hardness is given that anything reaches: the slope of the loading curve of contacts that yield was
        not compared with simulations; `unloading_stiffness_scatter` is that of their unloading
        stiffness.
        """
        value: Numbers = self.quantity("stiffness_scatter")
        return value

    @property
    def unloading_stiffness_scatter(self) -> Numbers:
        """Model uncertainty, one standard deviation of ln `unloading_stiffness` at this pressure.

        Also of the solid conductance and of the tangential stiffness, which are proportional to it.
        Without a hardness both stiffnesses are the same, and so are their uncertainties.
        """
        value: Numbers = self.quantity("unloading_stiffness_scatter")
        return value

    @property
    def separation_scatter(self) -> Numbers:
        """Model uncertainty of the mean separation at this pressure [length], `scatter` times F/(-dF/du)."""
        value: Numbers = self.quantity("separation_scatter")
        return value

    @property
    def energy_scatter(self) -> Numbers:
        """Model uncertainty, one standard deviation of ln `energy`: with a hardness that at this pressure, else `scatter`."""
        value: Numbers = self.quantity("energy_scatter")
        return value

    @property
    def valid(self) -> Numbers:
        """Whether the theory was tested for such contacts; if not, `reasons` gives where and why."""
        value: Numbers = self.quantity("valid")
        return value


class LawQuantities:
    """Quantities of a law, as functions of a gap, the pressure or the area."""

    def mean_separation(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Mean separation u = (h_max + d)/2 (50) [length]: the mean gap, with yielded points flattened."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("mean_separation")
        return value

    def plane_separation(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Gap between the mean planes [length]: u less the flattening of yielded points."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("plane_separation")
        return value

    def mean_pressure(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Mean pressure in the contact, F/A [stress]; NaN where there is none."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("mean_pressure")
        return value

    def yielded(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Share of the contact area at the hardness, 0 to 1."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("yielded")
        return value

    def psi(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Plasticity index E* g/p_m, g the rms gradient; 0 where the hardness is infinite."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("psi")
        return value

    def elastic_hardness(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Hardness above which the elastic area is within 5%, E* g/1.1 [stress]."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("elastic_hardness")
        return value

    def tangential_stiffness(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Tangential stiffness of full stick [stress/length], `unloading_stiffness`/kappa (Mindlin 1949)."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("tangential_stiffness")
        return value

    def total_conductance(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Thermal conductance of the solid spots and of the gas in parallel [W/(m^2 K)]."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("total_conductance")
        return value

    def solid_conductance(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Thermal or electrical conductance of the solid spots, h = (k_s/E*) (-dF/du), at constant contact area.

        Conductance and stiffness solve the same potential problem (J. R. Barber, Proc. R. Soc. A
        459 (2003) 53). In W/(m^2 K) for conductivities such as "45 W/(m K)", in S/m^2 for "6e6 S/m".
        The slope of the loading curve of yielded contacts is up to ten times smaller.
        """
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("solid_conductance")
        return value

    def gas_conductance(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Thermal conductance of the gas in the gaps, parallel to that of the solid spots [W/(m^2 K)]."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("gas_conductance")
        return value

    def total_conductance_scatter(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Model uncertainty, one standard deviation of ln `total_conductance` at this pressure.

        Those of `solid_conductance` and `gas_conductance`, each times its share of the total, in
        quadrature.
        """
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("total_conductance_scatter")
        return value

    def solid_conductance_scatter(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Model uncertainty, one standard deviation of ln `solid_conductance` at this pressure.

        That of the unloading stiffness, to which the conductance is proportional. The
        uncertainty of the conductivities is not included.
        """
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("solid_conductance_scatter")
        return value

    def gas_conductance_scatter(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Model uncertainty, one standard deviation of ln `gas_conductance` at this pressure; 0 in vacuum.

        That of the distribution of gaps, by simulations with known mean gap and area, and that
        of the mean gap (`separation_scatter`), in quadrature. NaN where no simulation was
        compared: of areas outside 0.1% to 75%, and temperature jumps below 0.03 h_rms. The
        uncertainty of the gas's conductivity and accommodation is not included.
        """
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("gas_conductance_scatter")
        return value

    def flow_coefficient(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Flow coefficient K of the gaps [length^3], `leakage.K`."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("flow_coefficient")
        return value

    def hydraulic_aperture(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """K^(1/3) [length], the gap of parallel plates with the same flow."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("hydraulic_aperture")
        return value

    def leakage_scatter(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Model uncertainty, one standard deviation of ln of the flow coefficient."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("leakage_scatter")
        return value

    def leak_rate(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Leak rate of the joint's seal, in its unit: that of `Leakage.gas` or `Leakage.liquid`."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("leak_rate")
        return value

    def leak_rate_scatter(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Model uncertainty, one standard deviation of ln `leak_rate`: that of the flow coefficient and of the law of gases."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("leak_rate_scatter")
        return value

    def median_gap(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Median of the open gaps [length], by the law of docs/adhesion.md, of a simulated map by the map itself."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("median_gap")
        return value

    def attraction(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Mean attraction that presses the contact beside the load [stress], effective less net pressure."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("attraction")
        return value

    def pull_off(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Largest tension F/A0 that the bodies bear, at least 0 [stress], of the surface and bodies."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("pull_off")
        return value

    def zero_load_gap(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Mean gap of the bodies at zero load [length], after they were pressed together."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("zero_load_gap")
        return value

    def zero_load_area(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """A/A0 at zero load, after the bodies were pressed together."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("zero_load_area")
        return value

    def effective_work(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Work per nominal area of parting the bodies from zero load [stress length], the integral of the tension over u."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("effective_work")
        return value

    def tabor_number(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Tabor's number of a summit, (2 w^2/(c E*^2 rho^3))^(1/3) with the rms Laplacian c of the heights."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("tabor_number")
        return value

    def scatter(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Model uncertainty, one standard deviation of ln F at this mean separation; NaN if unknown."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("scatter")
        return value

    def area_scatter(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Model uncertainty, one standard deviation of ln A at this pressure."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("area_scatter")
        return value

    def stiffness_scatter(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Model uncertainty, one standard deviation of ln `stiffness` at this pressure.

        NaN where a hardness is given that anything reaches: the slope of the loading curve of contacts that yield was
        not compared with simulations; `unloading_stiffness_scatter` is that of their unloading
        stiffness.
        """
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("stiffness_scatter")
        return value

    def unloading_stiffness_scatter(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Model uncertainty, one standard deviation of ln `unloading_stiffness` at this pressure.

        Also of the solid conductance and of the tangential stiffness, which are proportional to it.
        Without a hardness both stiffnesses are the same, and so are their uncertainties.
        """
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("unloading_stiffness_scatter")
        return value

    def separation_scatter(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Model uncertainty of the mean separation at this pressure [length], `scatter` times F/(-dF/du)."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("separation_scatter")
        return value

    def energy_scatter(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Model uncertainty, one standard deviation of ln `energy`: with a hardness that at this pressure, else `scatter`."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("energy_scatter")
        return value

    def valid(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Whether the theory was tested for such contacts; if not, `reasons` gives where and why."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("valid")
        return value


class JointQuantities:
    """Quantities of a joint, as functions of the pressure."""

    def mean_separation(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Mean separation u = (h_max + d)/2 (50) [length]: the mean gap, with yielded points flattened."""
        value: Numbers = self.at_pressure(pressure).quantity("mean_separation")
        return value

    def separation(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Separation d between the rigid plane and the mid-plane [length]."""
        value: Numbers = self.at_pressure(pressure).quantity("separation")
        return value

    def plane_separation(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Gap between the mean planes [length]: u less the flattening of yielded points."""
        value: Numbers = self.at_pressure(pressure).quantity("plane_separation")
        return value

    def area(self: Any, pressure: ArrayLike | str) -> Numbers:
        """A/A0; that of MBMA does not end at 1 under full compression, and is not clamped."""
        value: Numbers = self.at_pressure(pressure).quantity("area")
        return value

    def mean_pressure(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Mean pressure in the contact, F/A [stress]; NaN where there is none."""
        value: Numbers = self.at_pressure(pressure).quantity("mean_pressure")
        return value

    def yielded(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Share of the contact area at the hardness, 0 to 1."""
        value: Numbers = self.at_pressure(pressure).quantity("yielded")
        return value

    def psi(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Plasticity index E* g/p_m, g the rms gradient; 0 where the hardness is infinite."""
        value: Numbers = self.at_pressure(pressure).quantity("psi")
        return value

    def elastic_hardness(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Hardness above which the elastic area is within 5%, E* g/1.1 [stress]."""
        value: Numbers = self.at_pressure(pressure).quantity("elastic_hardness")
        return value

    def stiffness(self: Any, pressure: ArrayLike | str) -> Numbers:
        """-d(F/A0)/du [stress/length] of first loading, against the mean separation."""
        value: Numbers = self.at_pressure(pressure).quantity("stiffness")
        return value

    def unloading_stiffness(self: Any, pressure: ArrayLike | str) -> Numbers:
        """-d(F/A0)/du [stress/length] of a small unloading at constant contact area; `stiffness` if nothing yields.

        Of bodies that attract each other it is the elastic one at this gap, without the change of the attraction.
        """
        value: Numbers = self.at_pressure(pressure).quantity("unloading_stiffness")
        return value

    def tangential_stiffness(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Tangential stiffness of full stick [stress/length], `unloading_stiffness`/kappa (Mindlin 1949)."""
        value: Numbers = self.at_pressure(pressure).quantity("tangential_stiffness")
        return value

    def energy(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Elastic energy per nominal area [stress length] that unloading gives back, the integral of F/A0 over u."""
        value: Numbers = self.at_pressure(pressure).quantity("energy")
        return value

    def total_conductance(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Thermal conductance of the solid spots and of the gas in parallel [W/(m^2 K)]."""
        value: Numbers = self.at_pressure(pressure).quantity("total_conductance")
        return value

    def solid_conductance(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Thermal or electrical conductance of the solid spots, h = (k_s/E*) (-dF/du), at constant contact area.

        Conductance and stiffness solve the same potential problem (J. R. Barber, Proc. R. Soc. A
        459 (2003) 53). In W/(m^2 K) for conductivities such as "45 W/(m K)", in S/m^2 for "6e6 S/m".
        The slope of the loading curve of yielded contacts is up to ten times smaller.
        """
        value: Numbers = self.at_pressure(pressure).quantity("solid_conductance")
        return value

    def gas_conductance(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Thermal conductance of the gas in the gaps, parallel to that of the solid spots [W/(m^2 K)]."""
        value: Numbers = self.at_pressure(pressure).quantity("gas_conductance")
        return value

    def total_conductance_scatter(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Model uncertainty, one standard deviation of ln `total_conductance` at this pressure.

        Those of `solid_conductance` and `gas_conductance`, each times its share of the total, in
        quadrature.
        """
        value: Numbers = self.at_pressure(pressure).quantity("total_conductance_scatter")
        return value

    def solid_conductance_scatter(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Model uncertainty, one standard deviation of ln `solid_conductance` at this pressure.

        That of the unloading stiffness, to which the conductance is proportional. The
        uncertainty of the conductivities is not included.
        """
        value: Numbers = self.at_pressure(pressure).quantity("solid_conductance_scatter")
        return value

    def gas_conductance_scatter(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Model uncertainty, one standard deviation of ln `gas_conductance` at this pressure; 0 in vacuum.

        That of the distribution of gaps, by simulations with known mean gap and area, and that
        of the mean gap (`separation_scatter`), in quadrature. NaN where no simulation was
        compared: of areas outside 0.1% to 75%, and temperature jumps below 0.03 h_rms. The
        uncertainty of the gas's conductivity and accommodation is not included.
        """
        value: Numbers = self.at_pressure(pressure).quantity("gas_conductance_scatter")
        return value

    def flow_coefficient(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Flow coefficient K of the gaps [length^3], `leakage.K`."""
        value: Numbers = self.at_pressure(pressure).quantity("flow_coefficient")
        return value

    def hydraulic_aperture(self: Any, pressure: ArrayLike | str) -> Numbers:
        """K^(1/3) [length], the gap of parallel plates with the same flow."""
        value: Numbers = self.at_pressure(pressure).quantity("hydraulic_aperture")
        return value

    def leakage_scatter(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Model uncertainty, one standard deviation of ln of the flow coefficient."""
        value: Numbers = self.at_pressure(pressure).quantity("leakage_scatter")
        return value

    def leak_rate(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Leak rate of the joint's seal, in its unit: that of `Leakage.gas` or `Leakage.liquid`."""
        value: Numbers = self.at_pressure(pressure).quantity("leak_rate")
        return value

    def leak_rate_scatter(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Model uncertainty, one standard deviation of ln `leak_rate`: that of the flow coefficient and of the law of gases."""
        value: Numbers = self.at_pressure(pressure).quantity("leak_rate_scatter")
        return value

    def median_gap(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Median of the open gaps [length], by the law of docs/adhesion.md, of a simulated map by the map itself."""
        value: Numbers = self.at_pressure(pressure).quantity("median_gap")
        return value

    def attraction(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Mean attraction that presses the contact beside the load [stress], effective less net pressure."""
        value: Numbers = self.at_pressure(pressure).quantity("attraction")
        return value

    def pull_off(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Largest tension F/A0 that the bodies bear, at least 0 [stress], of the surface and bodies."""
        value: Numbers = self.at_pressure(pressure).quantity("pull_off")
        return value

    def zero_load_gap(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Mean gap of the bodies at zero load [length], after they were pressed together."""
        value: Numbers = self.at_pressure(pressure).quantity("zero_load_gap")
        return value

    def zero_load_area(self: Any, pressure: ArrayLike | str) -> Numbers:
        """A/A0 at zero load, after the bodies were pressed together."""
        value: Numbers = self.at_pressure(pressure).quantity("zero_load_area")
        return value

    def effective_work(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Work per nominal area of parting the bodies from zero load [stress length], the integral of the tension over u."""
        value: Numbers = self.at_pressure(pressure).quantity("effective_work")
        return value

    def tabor_number(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Tabor's number of a summit, (2 w^2/(c E*^2 rho^3))^(1/3) with the rms Laplacian c of the heights."""
        value: Numbers = self.at_pressure(pressure).quantity("tabor_number")
        return value

    def error(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Bound on the relative numerical error of pressure and area against the theory; NaN where not known."""
        value: Numbers = self.at_pressure(pressure).quantity("error")
        return value

    def scatter(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Model uncertainty, one standard deviation of ln F at this mean separation; NaN if unknown."""
        value: Numbers = self.at_pressure(pressure).quantity("scatter")
        return value

    def area_scatter(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Model uncertainty, one standard deviation of ln A at this pressure."""
        value: Numbers = self.at_pressure(pressure).quantity("area_scatter")
        return value

    def stiffness_scatter(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Model uncertainty, one standard deviation of ln `stiffness` at this pressure.

        NaN where a hardness is given that anything reaches: the slope of the loading curve of contacts that yield was
        not compared with simulations; `unloading_stiffness_scatter` is that of their unloading
        stiffness.
        """
        value: Numbers = self.at_pressure(pressure).quantity("stiffness_scatter")
        return value

    def unloading_stiffness_scatter(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Model uncertainty, one standard deviation of ln `unloading_stiffness` at this pressure.

        Also of the solid conductance and of the tangential stiffness, which are proportional to it.
        Without a hardness both stiffnesses are the same, and so are their uncertainties.
        """
        value: Numbers = self.at_pressure(pressure).quantity("unloading_stiffness_scatter")
        return value

    def separation_scatter(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Model uncertainty of the mean separation at this pressure [length], `scatter` times F/(-dF/du)."""
        value: Numbers = self.at_pressure(pressure).quantity("separation_scatter")
        return value

    def energy_scatter(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Model uncertainty, one standard deviation of ln `energy`: with a hardness that at this pressure, else `scatter`."""
        value: Numbers = self.at_pressure(pressure).quantity("energy_scatter")
        return value

    def valid(self: Any, pressure: ArrayLike | str) -> Numbers:
        """Whether the theory was tested for such contacts; if not, `reasons` gives where and why."""
        value: Numbers = self.at_pressure(pressure).quantity("valid")
        return value
