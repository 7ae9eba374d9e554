"""Slots of the extended Drucker-Prager law's `par`: its parameters as declared, derived values, the table."""

from __future__ import annotations

E, NU, BETA, PSI, K, KIND, SIGMA0, GAIN, RATE, PEAK, EPEAK, SLOPE, DAMAGE, E50, E60, UF, DMAX = range(17)
TAN_BETA, TAN_PSI, HARD_A, HARD_B, LOG_D2, D3, TABLE = range(17, 24)
