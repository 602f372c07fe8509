"""Published figures reproduced, checks against closed forms, records with hidden effects from independent equations."""
