"""The back end that is as fast as velocity, acceleration and jerk limits allow, by Ruckig."""
