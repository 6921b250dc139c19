"""Pictures of curves and plane fields."""
