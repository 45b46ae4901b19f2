"""bodyplan."""
