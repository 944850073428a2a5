"""A worker of the farm: the same cells and scenes, asked for over Celery."""
