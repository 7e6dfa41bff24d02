"""The service as seen from outside: metrics for Prometheus, traces for OpenTelemetry."""
